"""What a person is asked about the hand, and how an answer is told."""

from __future__ import annotations

from aero.channels import FINGERS, Channel
from hil.targets.target import Question

YES, NO, AGAIN, NONE = "yes", "no", "again", "none"
MOTIONS = {
    Channel.THUMB_ABDUCTION: "thumb swings across the palm",
    Channel.THUMB_CMC_FLEXION: "thumb bends at its base",
    Channel.THUMB_FLEXOR: "tip of the thumb curls",
}
"""What each channel of the thumb does, as it looks."""
STRAIGHT = (*FINGERS, Channel.THUMB_FLEXOR)
"""Channels whose digit is straight when it is open."""

YES_OR_NO = {"y": YES, "yes": YES, "n": NO, "no": NO}
OR_AGAIN = {"a": AGAIN, "again": AGAIN}
WHICH = (
    {str(channel + 1): channel.label for channel in Channel}
    | {channel.label: channel.label for channel in Channel}
    | {"0": NONE, "none": NONE}
    | OR_AGAIN
)


def digit(channel: Channel) -> str:
    """Return the digit that a channel moves, for people."""
    return f"{channel.label} finger" if channel in FINGERS else "tip of the thumb"


def all_straight() -> Question:
    """Return whether every open digit is straight."""
    text = (
        "The hand is open. Is every finger straight, and the tip of the thumb? A finger that is not in line with its "
        "neighbours by half a centimetre at the tip is bent."
    )
    return Question(text, "y, n", YES_OR_NO)


def straight(channel: Channel) -> Question:
    """Return whether one open digit is straight."""
    return Question(f"Is the {digit(channel)} straight?", "y, n", YES_OR_NO)


def which_moved(motion: str) -> Question:
    """Return which digit moved a little, three times."""
    named = [MOTIONS.get(channel, channel.label) for channel in Channel]
    legend = ", ".join(f"{number} {name}" for number, name in enumerate(named, start=1))
    return Question(
        "Something moved a little, three times. What was it?", f"{legend}, 0 nothing, a again", WHICH, motion
    )


def tip_followed(motion: str) -> Question:
    """Return whether a digit, half closed, followed each time it was moved a little to and fro."""
    text = "It closed half way and moved a little to and fro, three times. Did its tip follow each time?"
    return Question(text, "y, n, a again", YES_OR_NO | OR_AGAIN, motion)
