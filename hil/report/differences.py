"""Why a figure may differ from the paper's although the hand is within its limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

from aero.channels import FINGERS, Channel

NOTABLE = 0.1
"""Part of the paper's figure by which ours may differ without a word."""


@dataclass(frozen=True)
class Difference:
    """A reason that is known for some channels' figure."""

    metric: str
    channels: tuple[Channel, ...]
    reason: str


_THUMB = (
    "Here the whole window is commanded, and the thumb goes on until it meets something. The paper's fist is not "
    "published."
)
_WINDOW = "The paper read its hand's end stops; the command window is narrower"
DIFFERENCES = (
    Difference(
        "excursion_hand",
        (Channel.THUMB_ABDUCTION,),
        f"{_WINDOW}, and that of firmware 0.2.0 leaves out more of the open end.",
    ),
    Difference(
        "excursion_hand",
        (Channel.THUMB_CMC_FLEXION,),
        "Swept alone, without abduction, the thumb meets the palm about half way. The paper's figure is of a fist, "
        "which the experiment excursion measures.",
    ),
    Difference(
        "excursion_hand",
        (Channel.THUMB_FLEXOR,),
        "Swept alone, the thumb curls on to its own stop. The paper's figure fits a thumb that meets the fingers of a "
        "fist; that fist is not published.",
    ),
    Difference(
        "tracking_rms",
        FINGERS,
        "Hand and simulator both stop short on the open side, so their errors partly cancel.",
    ),
    Difference(
        "tracking_rms",
        (Channel.THUMB_CMC_FLEXION,),
        "Under cable friction this hand stops up to a whole step short of its goal. The paper's figure would take "
        "a hand that errs as its simulator does.",
    ),
    Difference(
        "tracking_rms",
        (Channel.THUMB_FLEXOR,),
        "Most of it is the simulator's own error while CMC flexion is swept and drags the flexor along.",
    ),
    Difference(
        "rise_model_ms",
        tuple(Channel),
        "The simulator's rise is counted in whole steps of its integrator: a step more or less is no difference.",
    ),
    Difference(
        "rise_hand_ms",
        tuple(Channel),
        "The paper's hand ran the firmware pre, which limits the acceleration; later versions do not.",
    ),
    Difference(
        "fist_travel",
        FINGERS,
        "Homing makes the finger's stop the closed end of its window, so the travel is the window's 45.26 mm less what "
        "friction and spring leave.",
    ),
    Difference("fist_travel", (Channel.THUMB_ABDUCTION,), f"{_WINDOW}."),
    *(Difference("fist_travel", (channel,), _THUMB) for channel in (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)),
    Difference(
        "fist_difference",
        FINGERS,
        "Simulator and hand get the same codes. Each finger of the simulator is routed a little differently, as in the "
        "paper, and homing sets where the hand's stop reads.",
    ),
    Difference("fist_difference", (Channel.THUMB_ABDUCTION,), f"{_WINDOW}."),
    *(
        Difference("fist_difference", (channel,), f"{_THUMB} The simulator's cable has no abduction coupling.")
        for channel in (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
    ),
)


def why(metric: str, channel: Channel, ours: float, paper: float | None) -> str:
    """Return why a figure may differ from the paper's, empty when it hardly does or no reason is known."""
    if not paper or math.isnan(ours) or abs(ours - paper) <= NOTABLE * abs(paper):
        return ""
    return reason(metric, channel)


def reason(metric: str, channel: Channel) -> str:
    """Return the reason that is known for a channel's figure, empty when there is none."""
    found = (known.reason for known in DIFFERENCES if known.metric == metric and channel in known.channels)
    return next(found, "")
