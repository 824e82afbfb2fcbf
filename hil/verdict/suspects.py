"""What a run leaves suspected: coarse rules over what its failures share, none ranked before another.

A rule names a `Clue`: the failures that it accounts for, and the parts that would make them. How much of all that
failed a clue accounts for decides how much it says. No clue convicts: `case.py` asks for a step that does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from aero.channels import FINGERS, Channel
from aero.errors import DesyncError
from aero.safety import SafetyReason
from hil.checks.shared.subjects import subject_words
from hil.faults.fault import Part
from hil.verdict.failures import FAR, Failures
from hil.verdict.limits import Key
from hil.verdict.parts import Suspect
from hil.verdict.run_end import EndKind, RunEnd

MANY = 3
"""Channels that fail alike from which on what all share is suspected before each."""
OF_SEVERAL = 0.06
"""How likely the board is where more than one channel fails: a sign, an order or a scale of its firmware."""
FALSIFIED = ("session/lost_replies", "presence/lost_replies", "session/stray_bytes")
"""Counts of bytes that nothing mechanical makes."""
TIMES = (
    "presence/round_trip",
    "response/telemetry_period",
    "response/command_to_motion",
    "replay/replay_delay",
)
STANDS_STILL = (
    "presence/distinct_readings",
    "response/standstill",
)
JUMPS = ("staircase/overshoot_hand_percent",)
OF_OLD_TELEMETRY = frozenset({*TIMES, *STANDS_STILL, *JUMPS, "replay/replay_shape", "staircase/rise_hand_ms"})
"""Readings that come out wrong where telemetry is old."""
TORQUE = {
    "excursion/closed_percent": -1,
    "excursion/fist_travel": -1,
    "excursion/stop_current": -1,
    "staircase/excursion_hand": -1,
    "staircase/tracking_rms": 1,
    "staircase/matched_steps": -1,
    "staircase/rise_hand_ms": 1,
    "staircase/spring": 1,
    "staircase/friction": 1,
    "audit/followed": -1,
    "audit/pull": 1,
    "holding/holding_current": 1,
    "response/open_close_rate": -1,
    "holding/creep_percent": 1,
    "coupling/stop_abducted": -1,
    "coupling/stop_without_abduction": -1,
}
"""Readings that too little torque moves, and to which side."""
SENSORS = ("presence/temperature", "alike/temperature", "staircase/resolution", "holding/creep_percent")
"""Readings that a servo makes by itself, whatever it pulls."""
PULLS = ("excursion/stop_current", "staircase/spring", "staircase/spring_shape", "holding/holding_current")
"""Readings of how much a servo pulls."""
CURRENTS = (*PULLS, "staircase/friction", "audit/pull")
"""Readings in ampere."""
TRAVEL = ("excursion/fist_travel", "coupling/stop_abducted", "coupling/stop_without_abduction")
"""Readings of how far a channel comes."""
IN_MOTION = {"replay", "response"}
"""Experiments that say nothing of loads and travel at rest."""
LEANS = 0.03
"""How likely the servo, or the digit, of another of the thumb's channels is."""
VAGUE = 0.06
"""How likely each shared part is where what fails on a channel is not clear."""
OPPOSED = -6.0
"""Excess of a current below which it has the other sign: one that is zero is less far off."""
UNLOADED = -2.2
"""Excess of a load against the springs from which on there is none, by the limits as they are."""
MOVED = "audit/others_moved"
OF_THE_LINK = ("session/", "presence/", "driver/", "run/")
THUMB = frozenset({Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR})


@dataclass(frozen=True)
class Clue:
    """What one rule says of a run."""

    seen: str
    """The observation, a sentence for people without a full stop."""
    accounts_for: frozenset[Key]
    weights: Mapping[Suspect, float]
    """How likely each is where the observation is right; about 1 together, less where it says little."""


@dataclass(frozen=True)
class RunSigns:
    """All that the rules read."""

    failures: Failures
    end: RunEnd
    reads_as: str = ""
    """How another firmware, side or homing would explain all readings; empty where none does."""


Rule = Callable[[RunSigns], Iterable[Clue]]


def _all(signs: RunSigns) -> frozenset[Key]:
    return frozenset(signs.failures.off)


def _hand(**weights: float) -> dict[Suspect, float]:
    return {Suspect(Part[name.upper()]): weight for name, weight in weights.items()}


def _orderly(signs: RunSigns) -> bool:
    return not signs.failures.hand(*FALSIFIED, "session/restarts")


def what_the_driver_sent(signs: RunSigns) -> Iterable[Clue]:
    """Compare commands and readings with their bytes."""
    # Damaged replies are misread by any driver; what it sent is its own, and spoils every reading.
    sent = signs.failures.keys(
        lambda check, _: check.startswith("driver/") and ("/read_" not in check or _orderly(signs))
    )
    if sent:
        yield Clue("the driver sent or read other values than the map gives", _all(signs), _hand(driver=0.97))


def restarts(signs: RunSigns) -> Iterable[Clue]:
    """A board that said its boot text."""
    # What was lost or changed with the restart is no sign of anything else.
    if signs.failures.hand("session/restarts"):
        yield Clue("the board restarted", _all(signs), _hand(board=0.35, supply=0.25, setup=0.25, usb=0.15))
    if signs.end.kind is EndKind.FIRMWARE:
        yield Clue("the firmware program ended", _all(signs), _hand(board=0.95))


def falsified_bytes(signs: RunSigns) -> Iterable[Clue]:
    """Bytes that were lost, added or altered, and a link that ended."""
    falsified = signs.failures.hand(*FALSIFIED)
    ended = signs.end.kind is EndKind.LINK or signs.end.stop in {SafetyReason.SILENT, SafetyReason.LINK_LOST}
    if isinstance(signs.end.error, ConnectionError):
        yield Clue("the port was gone", _all(signs), _hand(usb=0.75, board=0.15, computer=0.1))
    elif signs.failures.hand("session/restarts"):
        return  # a board that restarts answers late, not at all, or with its text
    elif falsified or isinstance(signs.end.error, DesyncError):
        # Nothing mechanical loses bytes; what the damaged replies made of the readings goes with them.
        yield Clue("bytes were lost or altered", _all(signs), _hand(usb=0.7, board=0.15, computer=0.1, bus=0.05))
    elif ended:
        yield Clue("the board stopped answering", _all(signs), _hand(board=0.45, usb=0.45, supply=0.1))
    elif signs.failures.hand("session/absent_values"):
        text = _hand(computer=0.55, usb=0.3, board=0.1, driver=0.05)
        yield Clue("something on the way takes bytes for text", _all(signs), text)
    elif signs.failures.hand("session/stalls"):
        yield Clue("the link stood still now and then", _all(signs), _hand(usb=0.5, computer=0.4, board=0.1))
    # A servo may overshoot by itself, on its channel alone: these speak for themselves alone.
    jumping = signs.failures.on("staircase/overshoot_hand_percent")
    own = signs.failures.keys(lambda check, _: check in JUMPS)
    if own and len(jumping) != 1:
        yield Clue("positions jump on the whole hand", own, _hand(usb=0.6, bus=0.25, board=0.15))


def standing_readings(signs: RunSigns) -> Iterable[Clue]:
    """Readings that repeat: a bus on which one servo is silent leaves all old values."""
    own = signs.failures.keys(lambda check, _: check in STANDS_STILL)
    still = signs.failures.on("response/standstill")
    if signs.end.stop is SafetyReason.STALE or signs.failures.hand("presence/distinct_readings"):
        yield Clue("no reading changes", _all(signs), _hand(bus=0.4, servo=0.35, usb=0.15, board=0.1))
    elif own and len(still) != 1:
        spoilt = signs.failures.keys(lambda check, _: check in OF_OLD_TELEMETRY)
        yield Clue("readings of several channels stand still on the way", spoilt, _hand(usb=0.35, bus=0.45, board=0.2))
    if contradicted := signs.failures.hand("presence/boot_contradictions"):
        yield Clue("the boot text contradicts the readings", contradicted, _hand(bus=0.7, board=0.3))


def late(signs: RunSigns) -> Iterable[Clue]:
    """Times of the link, which no load makes longer."""
    own = signs.failures.keys(lambda check, _: check in TIMES)
    trips = signs.failures.hand("presence/round_trip", "response/telemetry_period")
    delayed = len(signs.failures.on("replay/replay_delay", 1)) >= MANY
    if signs.end.stop is SafetyReason.UNWATCHED:
        yield Clue("the program held up its own poll of the hand", _all(signs), _hand(computer=0.9))
    if trips:
        spoilt = signs.failures.keys(lambda check, _: check in OF_OLD_TELEMETRY)
        # Where each reply comes in time and the readings are old, a loop of the board may be slow, or its bus.
        old = _hand(usb=0.3, computer=0.1, bus=0.25, board=0.35)
        slow = _hand(usb=0.45, computer=0.2, bus=0.15, board=0.15)
        yield Clue("replies come late", spoilt, slow if signs.failures.hand("presence/round_trip") else old)
    elif delayed or signs.failures.hand("response/command_to_motion"):
        late_on_all = _hand(usb=0.35, bus=0.25, board=0.25, driver=0.1, computer=0.05)
        yield Clue("the hand moves late after its commands", own, late_on_all)


def another_setting(signs: RunSigns) -> Iterable[Clue]:
    """Readings that a healthy hand of another version, or one that was not homed, would have."""
    if signs.reads_as:
        yield Clue(signs.reads_as, _all(signs), _hand(setup=0.75, board=0.25))
    elif moved := signs.failures.keys(lambda check, _: check == "window/window_moved"):
        yield Clue("windows do not begin where homing leaves them", moved, _hand(setup=0.75, board=0.25))
    elif unanswered := signs.failures.hand("session/unanswered_limits"):
        # A board of firmware `pre` leaves limits unanswered; so does a link that loses, which the rule above sees.
        keys = _all(signs) if _orderly(signs) else unanswered
        yield Clue("the board does not know the limits of the named firmware", keys, _hand(setup=0.5, board=0.5))


def torque_of_all(signs: RunSigns) -> Iterable[Clue]:
    """Many channels to the side of too little torque."""
    weak = signs.failures.keys(
        lambda check, subject: check in TORQUE and signs.failures.excess(check, subject) * TORQUE[check] > 0
    )
    on = {subject for _, _, subject in weak} - {"hand"}
    # The thumb's three lean on each other; fingers share nothing but their supply.
    slow_hand = signs.failures.excess("response/open_close_rate", "hand") < 0.0 and len(_channels(signs.failures)) != 1
    if (len(on) >= MANY and on & {finger.label for finger in FINGERS}) or slow_hand:
        yield Clue("several channels are weak or slow", weak, _hand(supply=0.75, setup=0.15, board=0.1))


def currents_alone(signs: RunSigns) -> Iterable[Clue]:
    """Currents of several channels to one side, where all moves as it should."""
    failures = signs.failures
    channels = failures.keys(lambda check, on: on != "hand" and not check.startswith(OF_THE_LINK))
    off = [failures.off[key] for key in channels if f"{key[0]}/{key[1]}" in CURRENTS]
    # Two servos do not read too little at once: a scale or a limit that they share does.
    if off and len(off) == len(channels) and len(_channels(failures)) > 1:
        # What is weak draws more for as much; a scale, or a limit of another version, may read less.
        high = _hand(supply=0.5, setup=0.25, board=0.2) if min(off) > 0.0 else {}
        low = _hand(board=0.6, setup=0.2, supply=0.1) if max(off) < 0.0 else {}
        yield Clue("currents of several channels are off, and all moves", channels, high | low)


def alike_on_many(signs: RunSigns) -> Iterable[Clue]:
    """One check that fails to one side on most channels."""
    # What comes late has a rule of its own: no set-up delays it.
    off = signs.failures.off
    sides = {(check, excess > 0) for (e, m, _), excess in off.items() if (check := f"{e}/{m}") not in TIMES}
    shared = {
        check
        for check, high in sides
        if len(on := signs.failures.on(check, 1 if high else -1)) >= MANY and on & set(FINGERS)
    }
    own = signs.failures.keys(lambda check, _: check in shared)
    if own:
        yield Clue(
            "most channels fail alike",
            own,
            _hand(setup=0.38, board=0.23, supply=0.14, driver=0.1, bus=0.1, computer=0.05),
        )


def several_channels(signs: RunSigns) -> Iterable[Clue]:
    """Channels that fail in whatever ways: parts of several at once are less likely than one that they share."""
    own = {channel: keys for channel in Channel if (keys := _own(signs.failures, channel))}
    # The thumb's channels lean on each other.
    if len(own.keys() - THUMB) + bool(own.keys() & THUMB) >= MANY:
        # What all share says less where no check fails alike: each channel's own rule stands beside it.
        shared = _hand(bus=0.1, supply=0.1, setup=0.08, board=0.06, usb=0.02, driver=0.02, computer=0.02)
        yield Clue("several channels fail", frozenset().union(*own.values()), shared)


def two_exchanged(signs: RunSigns) -> Iterable[Clue]:
    """Two channels of which one moves when the other is commanded, or two fingers that fail about as much."""
    failures = signs.failures
    moved = failures.on(MOVED)
    failing = {channel: weight for channel in Channel if (weight := failures.weight(_own(failures, channel)))}
    both = len(failing) == 2 and failing.keys() <= set(FINGERS) and 3.0 * min(failing.values()) > max(failing.values())
    two = moved if len(moved & failures.on("audit/followed", -1)) == 2 else frozenset(failing if both else ())
    if two:
        labels = {channel.label for channel in two}
        own = failures.keys(lambda _, subject: subject in labels)
        # What is exchanged is seen at either; two parts at once are less likely than what both share.
        weights = {Suspect(Part.DIGIT, min(two)): 0.3, Suspect(Part.SERVO, min(two)): 0.2}
        yield Clue("two channels fail together", own, weights | _hand(board=0.2, bus=0.05, setup=0.3, driver=0.1))


def one_channel(signs: RunSigns) -> Iterable[Clue]:
    """What fails on one channel, for each."""
    failures = signs.failures
    for channel in Channel:
        own = _own(failures, channel)
        ended = signs.end.channel is channel
        if not own and not ended:
            continue
        sensed = failures.weight(own & failures.keys(lambda check, _: check in SENSORS))
        still = failures.weight(own & failures.keys(lambda check, _: check in STANDS_STILL))
        jumping = failures.weight(own & failures.keys(lambda check, _: check in JUMPS))
        everything = failures.weight(own) or 1.0
        alone = len(_channels(failures)) <= 1
        servo, setup = 0.35 + 0.5 * sensed / everything, 0.12
        digit, board, driver = 0.85 - servo, 0.0 if alone else OF_SEVERAL, 0.0
        short = any(failures.excess(check, channel.label) < 0.0 for check in TRAVEL)
        if short and not any(failures.excess(check, channel.label) > FAR for check in PULLS):
            # What stops early and pulls at nothing was told to stop there, by a limit in its servo or by its command.
            servo, digit, board, setup, driver = 0.5, 0.2, 0.18, 0.03, 0.06
        elif failures.excess("audit/pull", channel.label) < OPPOSED:
            # No load makes a current flow the other way: a sign does, of the firmware or of the motor's poles.
            servo, digit, board = 0.3, 0.2, 0.4
        elif failures.excess("staircase/spring", channel.label) < UNLOADED:
            # No zero takes all load away.
            setup = 0.03
        in_motion = bool(own) and all(experiment in IN_MOTION for experiment, _, _ in own)
        if in_motion:
            # No load and no travel is off: what is late or jerky only in fast motion is hardly mechanical.
            servo, digit, board = 0.5, 0.15, board + 0.1
        # What is a little off may be the work of what all channels share, which shows most on this one.
        supply = VAGUE if everything < FAR else 0.0
        board, driver = board + supply, driver + 0.5 * supply
        # What answers only now and then stands still and jumps; nothing mechanical does.
        plug = 0.01 if short else 0.13 if in_motion else 0.03
        bus, usb = plug + 0.3 * still / everything, 0.1 * jumping / everything
        board += 0.3 * still / everything
        weights = {Suspect(Part.SERVO, channel): servo, Suspect(Part.DIGIT, channel): digit}
        for other in THUMB - {channel} if channel in THUMB else ():
            # What one of the thumb's servos does not hold may be seen on another.
            weights |= {Suspect(Part.SERVO, other): LEANS, Suspect(Part.DIGIT, other): LEANS}
        keys = _all(signs) if ended and alone else own | _with(failures, channel)
        shared = _hand(setup=setup, bus=bus, usb=usb, board=board, driver=driver, supply=supply)
        yield Clue(f"readings of the {subject_words(channel.label)} are off", keys, weights | shared)


def _own(failures: Failures, channel: Channel) -> frozenset[Key]:
    """Return what failed on a channel: its driver's bytes are not its own, nor what it moved with another's command."""
    return failures.keys(lambda check, on: on == channel.label and check != MOVED and not check.startswith("driver/"))


def _with(failures: Failures, channel: Channel) -> frozenset[Key]:
    """Return what else a channel makes fail: readings of the hand, its neighbours' encoders, the thumb's coupling."""
    coupled = {one.label for one in THUMB} if channel in THUMB else set()
    return failures.keys(
        lambda check, on: (
            (on == "hand" and not check.startswith(OF_THE_LINK))
            or check == MOVED
            or (check.startswith("coupling/") and on in coupled)
            # CMC flexion stops at the palm where abduction lets it.
            or (channel is Channel.THUMB_ABDUCTION and on == Channel.THUMB_CMC_FLEXION.label)
        )
    )


RULES: tuple[Rule, ...] = (
    what_the_driver_sent,
    restarts,
    falsified_bytes,
    standing_readings,
    late,
    another_setting,
    torque_of_all,
    currents_alone,
    alike_on_many,
    several_channels,
    two_exchanged,
    one_channel,
)


def _channels(failures: Failures) -> set[str]:
    return {subject for _, _, subject in failures.off} - {"hand"}


def clues(signs: RunSigns) -> tuple[Clue, ...]:
    """Return what the rules say of a run."""
    return tuple(clue for rule in RULES for clue in rule(signs))


def suspected(signs: RunSigns, found: Iterable[Clue]) -> dict[Suspect, float]:
    """Return how likely each suspect is by the clues of a run; they sum to 1."""
    total = signs.failures.weight(signs.failures.off)
    weights: dict[Suspect, float] = {}
    for clue in found:
        # A suspect that leaves most of the failures unexplained must not win over one that accounts for them.
        share = signs.failures.weight(clue.accounts_for) / total if total else 1.0
        for suspect, weight in clue.weights.items():
            weights[suspect] = max(weights.get(suspect, 0.0), weight * share**SHARPNESS)
    scale = sum(weights.values())
    return {suspect: weight / scale for suspect, weight in sorted(weights.items(), key=lambda one: -one[1])}


SHARPNESS = 3.0
