"""Look: single-channel motions that a person watches and describes.

Finds faults invisible to the encoders: exchanged fingers, wrong zeros and spools, slack. The hand is open during a
question. Records `codes`, `command_codes`, `currents` and `temperatures`; answers are stored as header parameters, and
as events with the questions.
"""

from collections.abc import Callable

from aero.channels import FINGERS, Channel
from hil.checks.shared.experiment import OPENED, Measured, Sampler, one_closed
from hil.dialogue.asker import Choice, Option
from hil.recordings.errors import CannotBeMeasuredError
from hil.recordings.recorder import Progress, Recorder
from hil.recordings.recording import Recording
from hil.targets.hand_errors import LookEndedError, MissingCapabilityError
from hil.targets.target import Target

YES, NO, AGAIN, NONE = "yes", "no", "again", "none"
MOTIONS = {
    Channel.THUMB_ABDUCTION: "thumb swings across the palm",
    Channel.THUMB_CMC_FLEXION: "thumb bends at its base",
    Channel.THUMB_FLEXOR: "tip of the thumb curls",
}
"""Visible motion of each thumb channel."""
STRAIGHT = (*FINGERS, Channel.THUMB_FLEXOR)
"""Channels whose digit is straight when open."""
YES_OR_NO = (Option("yes", YES, "y"), Option("no", NO, "n"))
OR_AGAIN = (Option("again", AGAIN, "a"),)
WHICH = (
    *(
        Option(MOTIONS.get(channel, channel.label), channel.label, str(number))
        for number, channel in enumerate(Channel, start=1)
    ),
    Option("nothing", NONE, "0"),
    *OR_AGAIN,
)
NUDGE = {channel: 0.1 if channel in FINGERS or channel is Channel.THUMB_ABDUCTION else 0.15 for channel in Channel}
"""Small motion, fraction of the window; bends a taut finger by 10 degrees or more, a slack one not at all."""
TO_AND_FRO = (0.4, 0.5)
"""Half-closed positions, fraction of the window."""
TIMES = 3
"""Repetitions of each motion."""
HOLD_S = 0.6
"""Time at each position, s."""
FURTHEST = (TO_AND_FRO[1],) * 7
"""Largest commanded fraction of each channel's window, command order."""


def run(target: Target, recorder: Recorder, progress: Progress) -> None:
    """Show each channel's motion and ask the target's onlooker.

    Raises:
        MissingCapabilityError: nobody looks.
        LookEndedError: the person ended it; the hand is open.
    """
    if target.onlooker is None:
        raise MissingCapabilityError("nobody looks at the hand: run `aero-hil validate --only look` on a terminal")
    recorder.begin({"nudge_thumb": NUDGE[Channel.THUMB_FLEXOR], "hold_s": HOLD_S})
    moves = 1 + len(Channel) * (2 * TIMES + 2 * TIMES + 2)
    look = _Look(Sampler(target, recorder, progress, moves * HOLD_S), target.onlooker)
    try:
        look.all_open()
        for channel in Channel:
            look.nudged(channel)
            look.to_and_fro(channel)
    except KeyboardInterrupt as error:
        look.end()
        raise LookEndedError("the look was aborted; the hand is open") from error


def digit(channel: Channel) -> str:
    """Return the name of the digit that a channel moves."""
    return f"{channel.label} finger" if channel in FINGERS else "tip of the thumb"


def all_straight() -> Choice[str]:
    """Return the question whether all open digits are straight."""
    text = (
        "The hand is open. Is every finger straight, and the tip of the thumb? A finger that is not in line with its "
        "neighbours by half a centimetre at the tip is bent."
    )
    return Choice(text, YES_OR_NO)


def straight(channel: Channel) -> Choice[str]:
    """Return the question whether one open digit is straight."""
    return Choice(f"Is the {digit(channel)} straight?", YES_OR_NO)


def which_moved(motion: str) -> Choice[str]:
    """Return the question which digit moved."""
    return Choice("Something moved a little, three times. What was it?", WHICH, motion)


def tip_followed(motion: str) -> Choice[str]:
    """Return the question whether a half-closed digit followed small motions."""
    text = "It closed half way and moved a little to and fro, three times. Did its tip follow each time?"
    return Choice(text, YES_OR_NO + OR_AGAIN, motion)


class _Look:
    def __init__(self, sampler: Sampler, onlooker: Callable[[Choice[str]], str]) -> None:
        self._sampler = sampler
        self._onlooker = onlooker

    def all_open(self) -> None:
        """Ask for bent digits of the open hand."""
        self._sampler.hold(OPENED, HOLD_S, "open hand")
        if self._asked(all_straight()) == NO:
            bent = [channel.label for channel in STRAIGHT if self._asked(straight(channel)) == NO]
        else:
            bent = []
        self._sampler.recorder.note_parameters(bent=" ".join(bent))

    def nudged(self, channel: Channel) -> None:
        """Ask for the digit that moves with one channel."""
        motion = f"{channel.label}, a little"

        def show() -> None:
            for _ in range(TIMES):
                self._sampler.hold(one_closed(channel, NUDGE[channel]), HOLD_S, motion)
                self._sampler.hold(OPENED, HOLD_S, motion)

        moved = self._asked(which_moved(motion), show)
        self._sampler.recorder.note_parameters(**{f"moved_{channel.label}": moved})

    def to_and_fro(self, channel: Channel) -> None:
        """Ask whether the tip follows small motions of one half-closed channel."""
        motion = f"{channel.label}, to and fro"
        near, far = TO_AND_FRO

        def show() -> None:
            self._sampler.hold(one_closed(channel, near), HOLD_S, f"{channel.label}, half closed")
            for _ in range(TIMES):
                self._sampler.hold(one_closed(channel, far), HOLD_S, motion)
                self._sampler.hold(one_closed(channel, near), HOLD_S, motion)
            self._sampler.hold(OPENED, HOLD_S, "open hand")

        followed = self._asked(tip_followed(motion), show)
        self._sampler.recorder.note_parameters(**{f"followed_{channel.label}": followed})

    def end(self) -> None:
        """Open the hand."""
        self._sampler.resume()
        self._sampler.hold(OPENED, HOLD_S, "open hand")
        self._sampler.recorder.note("the look was ended; the hand is open", "warning")

    def _asked(self, question: Choice[str], show: Callable[[], None] = lambda: None) -> str:
        while True:
            show()
            answer = self._onlooker(question)
            # the person's answering time must not be caught up by faster samples
            self._sampler.resume()
            self._sampler.recorder.note(f"{question.text} {answer}")
            if answer != AGAIN:
                return answer


def measure(recording: Recording) -> Measured:
    """Return the answers by channel: another digit moved, starts late, is bent, stays behind.

    Raises:
        ValueError: an answer is missing; the look was ended.
    """
    answers = recording.header.parameters
    labels = [channel.label for channel in Channel]
    wanted = ["bent", *(f"{what}_{label}" for label in labels for what in ("moved", "followed"))]
    if missing := [name for name in wanted if name not in answers]:
        raise CannotBeMeasuredError(f"there is no answer to {missing[0]}; the look was aborted")
    bent = str(answers["bent"]).split()
    found: dict[str, dict[str, float]] = {}
    for channel in Channel:
        label, moved = channel.label, str(answers[f"moved_{channel.label}"])
        found[label] = {
            "another_moved": 0.0 if moved in (label, NONE) else 1.0 + labels.index(moved),
            "starts_late": float(moved == NONE),
            "stays_behind": float(answers[f"followed_{label}"] == NO),
        }
        if channel in STRAIGHT:
            found[label]["bent"] = float(label in bent)
    return found
