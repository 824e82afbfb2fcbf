"""Fault isolation: from the evidence of a failed run to the parts that may be at fault.

Theory
======
A run measures symptoms. Several faults have equal symptoms: a dead motor and a cable off its spool both leave a finger
open. Faults that a test cannot distinguish are an *ambiguity group*. Weighing the symptoms cannot split the group, but
another test can. A run therefore only names the group, and `case.py` sequences the tests (*steps*) that split it.

Evidence. Each judged metric is evidence of a kind (`EvidenceKind` in its checks.toml): travel, torque, time, bytes. All
failed readings of one kind on one channel are one piece of evidence, so that an additional metric of one cause does not
change the conclusions. A stop of the guard is a piece of evidence on the channel that the guard names.

Layers. Measurements presuppose others. Readings are meaningful only if the driver decodes the board's bytes, the bytes
arrived, and the board has read its servos. Loads are meaningful only with the named firmware and zeros on the board.
The rules are therefore in layers, in this order: driver, link, freshness, setting, mechanics.

Clues. A rule yields a `Clue`: its observation, the parts that usually cause it (*strong*), the parts that may cause it
(*weak*), and the pieces of evidence that it explains. A clue about the hand explains a piece if each of its strong
parts can cause it (table `CAN`): the test that finds the part then settles the piece, too. A lossy link explains late
and jumping motion, and no missing torque of one finger. A clue about a digit explains what any of its parts can cause
there. What a layer leaves unexplained goes on to the next layer, and becomes a clue with suspects of its own. Two
faults at once are two clues. A chance event that does not recur takes its clue with it.

Strong and weak. The ambiguity group of a clue is its strong suspects. A long list is safe: a step that ends the failure
clears all others at once, and only a part that a step has shown is convicted. Shared parts of later clues are weak
suspects of the earlier ones; they replace the strong ones after steps have cleared these.

Sharing. Digits share only supply, board, bus and set-up; the three channels of the thumb are coupled and count as one
unit, and their mechanics as one digit. Evidence on more than two units points to shared parts. A unit with several
kinds of evidence has a clue of its own; a single kind beside it is taken for a consequence. Two units with equal kinds
may touch, be exchanged, or share a weak supply.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from aero.channels import FINGERS, Channel
from aero.errors import DesyncError, NoTelemetryError
from aero.safety import SafetyReason
from hil.checks.shared.declaration import EvidenceKind as Kind
from hil.checks.shared.subjects import SUBJECTS, subject_words
from hil.verdict.failures import LABELS, Failures, Piece
from hil.verdict.part import Part
from hil.verdict.parts import Suspect, listed
from hil.verdict.run_end import EndKind, RunEnd

PAIR = 2
"""Limit of failing units for a cause between two units, such as an exchange or contact."""
THUMB = frozenset({Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR})
IN_MOTION = frozenset({Kind.TIME, Kind.STALE, Kind.JUMP, Kind.SPEED})
"""Kinds of evidence that neither a static load nor a wrong zero causes."""
EVERYWHERE = frozenset(SUBJECTS)
"""Subjects of a clue whose other readings are not of the hand."""
LOADED = frozenset({Kind.TRAVEL, Kind.TORQUE, Kind.SPEED})
"""Kinds of evidence that a static load causes."""
ON_THE_LINK = frozenset({Kind.BYTES, Kind.TEXT, Kind.STALL, Kind.LINK_TIME, Kind.STALE, Kind.TIME, Kind.JUMP})
"""Kinds of evidence that lost, late or altered bytes cause."""
OF_A_HAND = frozenset(Kind) - {Kind.SENT, Kind.SEEN}
"""Kinds of evidence that a hand can cause without its driver."""
CAN: Mapping[Part, frozenset[Kind]] = {
    Part.COMPUTER: ON_THE_LINK | {Kind.READ, Kind.VERSION, Kind.SENT, Kind.TRAVEL},
    Part.DRIVER: frozenset(Kind) - {Kind.SEEN, Kind.BYTES, Kind.TEXT, Kind.RESTART},
    Part.USB: ON_THE_LINK | {Kind.READ, Kind.VERSION, Kind.RESTART, Kind.BOOT},
    Part.BOARD: OF_A_HAND,
    Part.SUPPLY: OF_A_HAND - {Kind.TEXT, Kind.READ, Kind.CROSSED, Kind.WINDOW, Kind.VERSION},
    Part.BUS: OF_A_HAND - {Kind.TEXT, Kind.READ, Kind.WINDOW, Kind.VERSION},
    Part.SERVO: LOADED | IN_MOTION | {Kind.OWN_SENSOR, Kind.CROSSED, Kind.BOOT, Kind.LINK_TIME},
    Part.DIGIT: LOADED | {Kind.TIME, Kind.JUMP, Kind.OWN_SENSOR, Kind.CROSSED},
    Part.SETUP: OF_A_HAND - {Kind.BYTES, Kind.TEXT, Kind.STALL, Kind.RESTART, Kind.READ},
}
"""Kinds of evidence that a part can cause."""
SEVERAL = 2
"""Number of kinds of evidence from which a second unit has a clue of its own; one kind may follow from the first."""


@dataclass(frozen=True)
class Clue:
    """Conclusion of one rule."""

    seen: str
    """Observation as a sentence without a full stop."""
    strong: frozenset[Suspect]
    """Parts that usually cause the observation."""
    weak: frozenset[Suspect] = frozenset()
    """Parts that may cause the observation."""
    on: frozenset[str] | None = None
    """Subjects that the strong parts act on; None for all."""
    explains: frozenset[Piece] = frozenset()
    """Pieces of evidence that the clue explains."""

    def can_explain(self, piece: Piece) -> bool:
        """Return whether each strong part, or any that acts on a named subject, can cause a piece of evidence."""
        can = [piece.kind in CAN[suspect.part] for suspect in self.strong]
        return all(can) if self.on is None else piece.subject in self.on and any(can)


@dataclass(frozen=True)
class RunSigns:
    """Input of the rules: failed checks, end of the run, version mismatch."""

    failures: Failures
    end: RunEnd
    reads_as: str = ""
    """Other firmware, side or homing that would explain all readings; otherwise empty."""
    silent: tuple[Channel, ...] = ()
    """Channels whose servos were silent at startup, according to the boot text."""

    @property
    def orderly(self) -> bool:
        """Whether all bytes arrived as sent."""
        return not self.hand & {Kind.BYTES, Kind.RESTART}

    @property
    def hand(self) -> frozenset[Kind]:
        """Kinds of evidence on the hand as a whole."""
        return self.failures.kinds("hand")

    @property
    def of_channels(self) -> dict[Channel, frozenset[Kind]]:
        """Kinds of evidence by channel, except crossed motion, driver bytes and the user's observations."""
        apart = {Kind.CROSSED, Kind.SENT, Kind.READ, Kind.SEEN}
        return {one: kinds for one in Channel if (kinds := self.failures.kinds(one.label) - apart)}

    @property
    def units(self) -> dict[frozenset[Channel], frozenset[Kind]]:
        """Kinds of evidence by failing unit: a finger, or the failing channels of the thumb."""
        found = self.of_channels
        of = {frozenset({one}): kinds for one, kinds in found.items() if one not in THUMB}
        if thumb := frozenset(found.keys() & THUMB):
            of[thumb] = frozenset().union(*(found[one] for one in thumb))
        return of


Rule = Callable[[RunSigns], Iterable[Clue]]


def _hand(*parts: Part) -> frozenset[Suspect]:
    return frozenset(map(Suspect, parts))


def _of(channels: Iterable[Channel], *parts: Part) -> frozenset[Suspect]:
    return frozenset(Suspect(part, channel) for channel in channels for part in parts)


def driver(signs: RunSigns) -> Iterable[Clue]:
    """Check commands and readings against their bytes."""
    kinds = {piece.kind for piece in signs.failures.pieces}
    # damaged replies make any driver return wrong readings
    if Kind.SENT in kinds or (Kind.READ in kinds and signs.orderly):
        yield Clue("the driver sent or read other values than the map gives", _hand(Part.DRIVER))


def link(signs: RunSigns) -> Iterable[Clue]:
    """Check for lost, added or altered bytes, restarts, and a lost link."""
    hand, end = signs.hand, signs.end
    answers = isinstance(end.error, NoTelemetryError)
    ended = (end.kind is EndKind.LINK and not answers) or end.stop in {SafetyReason.SILENT, SafetyReason.LINK_LOST}
    if end.kind is EndKind.FIRMWARE:
        yield Clue("the firmware program ended", _hand(Part.BOARD))
    elif Kind.RESTART in hand:
        # a restarting board answers late, not at all, or with its boot text
        yield Clue("the board restarted", _hand(Part.BOARD, Part.SUPPLY, Part.USB), _hand(Part.SETUP, Part.BUS))
    elif isinstance(end.error, ConnectionError):
        yield Clue("the port was gone", _hand(Part.USB, Part.BOARD, Part.COMPUTER), _hand(Part.SUPPLY))
    elif end.stop is SafetyReason.UNWATCHED:
        yield Clue("the program held up its own poll of the hand", _hand(Part.COMPUTER), _hand(Part.USB))
    elif (Kind.BYTES in hand and not ended) or isinstance(end.error, DesyncError):
        yield Clue("bytes were lost or altered", _hand(Part.USB, Part.BOARD, Part.COMPUTER), _hand(Part.BUS))
    elif ended:
        yield Clue("the board stopped answering", _hand(Part.USB, Part.BOARD, Part.COMPUTER), _hand(Part.SUPPLY))
    elif Kind.TEXT in hand:
        yield Clue("byte values are missing, as behind a text filter", _hand(Part.COMPUTER, Part.USB, Part.BOARD))
    elif Kind.STALL in hand:
        yield Clue("the link stood still now and then", _hand(Part.USB, Part.COMPUTER, Part.BOARD))


def fresh(signs: RunSigns) -> Iterable[Clue]:
    """Check for readings that are old, late, or not from the servos."""
    hand, channels = signs.hand, signs.of_channels
    shared = _hand(Part.USB, Part.BOARD, Part.BUS, Part.COMPUTER)
    if signs.silent:
        names = listed(subject_words(one.label) for one in signs.silent)
        strong = _of(signs.silent, Part.SERVO) | _hand(Part.BUS)
        yield Clue(f"no answer from the servo of the {names}", strong, on=EVERYWHERE)
    elif isinstance(signs.end.error, NoTelemetryError):
        silent = _hand(Part.BUS, Part.SERVO, Part.SUPPLY, Part.BOARD)
        yield Clue("the board has never read all servos since its start", silent, _hand(Part.SETUP), EVERYWHERE)
    elif signs.end.stop is SafetyReason.STALE or (Kind.STALE in hand):
        strong = _hand(Part.BUS, Part.SERVO, Part.BOARD, Part.USB)
        yield Clue("no reading changes", strong, _hand(Part.SUPPLY), EVERYWHERE)
    elif Kind.BOOT in hand:
        yield Clue("the boot text contradicts the readings", _hand(Part.BUS, Part.BOARD, Part.SETUP))
    elif Kind.LINK_TIME in hand:
        yield Clue("replies come late", shared, _hand(Part.DRIVER, Part.SETUP))
    elif channels and len(signs.units) > PAIR and all(kinds <= IN_MOTION for kinds in channels.values()):
        late = shared | _hand(Part.DRIVER)
        yield Clue("the hand is late or jumps in motion", late, _hand(Part.SUPPLY, Part.SETUP))


def setting(signs: RunSigns) -> Iterable[Clue]:
    """Check for readings of a healthy hand with another version or without homing."""
    if signs.reads_as:
        yield Clue(signs.reads_as, _hand(Part.SETUP, Part.BOARD))
    elif Kind.VERSION in signs.hand:
        yield Clue("the board does not know the limits of the named firmware", _hand(Part.SETUP, Part.BOARD))
    elif any(Kind.WINDOW in kinds for kinds in signs.of_channels.values()):
        yield Clue("a window is not where homing leaves it", _hand(Part.SETUP, Part.BOARD, Part.DRIVER))


def mechanics(signs: RunSigns) -> Iterable[Clue]:
    """Check loads, travel and sensors of the channels."""
    units = signs.units
    most = max(map(len, units.values()), default=0)
    leading = [unit for unit, kinds in units.items() if len(kinds) == most]
    crossed = {LABELS[one.subject] for one in signs.failures.pieces if one.kind is Kind.CROSSED}
    if crossed:
        two = crossed | signs.of_channels.keys() if len(units) <= PAIR else crossed
        shared = _hand(Part.BOARD, Part.DRIVER, Part.SETUP)
        on = frozenset(one.label for one in two)
        yield Clue("an encoder moves with another channel's command", _of(two, Part.SERVO, Part.DIGIT) | shared, on=on)
    if len(units) > PAIR or _alike(signs):
        yield _several()
    elif crossed and len(units) <= PAIR:
        yield from ()
    elif len(units) == PAIR == len(leading):
        yield from (_one(signs, unit, shared=PAIR_SHARES) for unit in _by_order(leading))
    elif units:
        own = [unit for unit, kinds in units.items() if unit == leading[0] or len(kinds) >= SEVERAL]
        follow = frozenset[Channel]().union(*(unit for unit in units if unit not in own))
        yield _one(signs, leading[0], others=follow)
        yield from (_one(signs, unit) for unit in _by_order(own) if unit != leading[0])
    elif Kind.SPEED in signs.hand or Kind.TIME in signs.hand:
        shared = _hand(Part.SUPPLY, Part.SETUP, Part.BOARD, Part.USB)
        yield Clue(f"the whole hand is {_pace(signs)}", shared, on=frozenset({"hand"}))


def _by_order(units: Iterable[frozenset[Channel]]) -> list[frozenset[Channel]]:
    return sorted(units, key=min)


def _pace(signs: RunSigns) -> str:
    """Return how the hand as a whole moves; the rate of opening and closing is high for a fast hand."""
    fast = any(one.kind is Kind.SPEED and one.high for one in signs.failures.pieces if one.subject == "hand")
    return "too fast" if fast else "slow"


def _alike(signs: RunSigns) -> bool:
    """Return whether one kind of evidence has one sign on more than two channels, a finger among them."""
    on: dict[tuple[Kind, bool], set[Channel]] = {}
    for channel in signs.of_channels:
        for piece in signs.failures.pieces:
            if piece.subject == channel.label:
                on.setdefault((piece.kind, piece.high), set()).add(channel)
    return any(len(channels) > PAIR and channels & set(FINGERS) for channels in on.values())


def _leaning(signs: RunSigns, unit: frozenset[Channel]) -> frozenset[Channel]:
    """Return the possibly faulty channels of a unit: abduction limits the range of CMC flexion."""
    goes_wrong = Kind.TRAVEL in signs.of_channels.get(Channel.THUMB_CMC_FLEXION, ())
    return unit | ({Channel.THUMB_ABDUCTION} if goes_wrong and unit <= THUMB else set())


def _several() -> Clue:
    shared = _hand(Part.SETUP, Part.SUPPLY, Part.BOARD, Part.BUS, Part.DRIVER, Part.COMPUTER)
    return Clue("several digits fail", shared, _hand(Part.USB))


PAIR_SHARES = _hand(Part.SETUP, Part.SUPPLY, Part.BOARD)
"""Parts that two units with equal evidence may share."""


def _one(
    signs: RunSigns,
    unit: frozenset[Channel],
    *,
    others: frozenset[Channel] = frozenset(),
    shared: frozenset[Suspect] = frozenset(),
) -> Clue:
    """Return the clue of the evidence on one unit; `others` are channels that follow, `shared` further strong parts."""
    channels = _leaning(signs, unit)
    kinds = frozenset[Kind]().union(*(signs.of_channels.get(one, frozenset({Kind.TRAVEL})) for one in channels))
    own, place = _of(channels, Part.SERVO), _of(THUMB if unit <= THUMB else channels, Part.DIGIT)
    # another program on the computer may command the hand as well
    all_share = _hand(Part.BOARD, Part.SUPPLY, Part.DRIVER, Part.COMPUTER)
    if kinds == {Kind.OWN_SENSOR}:
        strong, weak = own, place | _hand(Part.SETUP, Part.BUS) | all_share
    elif kinds <= IN_MOTION:
        strong, weak = own | _hand(Part.BUS, Part.BOARD), place | _hand(Part.SETUP, Part.USB) | all_share
    else:
        strong, weak = own | place | _hand(Part.SETUP), _hand(Part.BUS) | all_share
    strong |= shared
    if Kind.SPEED in signs.hand:
        # a weak supply fails first at the digit with the largest load, and slows the others
        strong |= _hand(Part.SUPPLY)
    weak |= _of(others | (THUMB if unit <= THUMB else frozenset()), Part.SERVO, Part.DIGIT)
    on = frozenset(one.label for one in (*channels, *others, *(THUMB if unit <= THUMB else ()))) | {"hand"}
    named = " and the ".join(subject_words(one.label) for one in sorted(unit))
    return Clue(f"readings of the {named} are off", strong, weak - strong, on)


LAYERS: tuple[Rule, ...] = (driver, link, fresh, setting, mechanics)
"""Rules, one per layer, ordered so that each layer's measurements presuppose the layers before."""


@dataclass(frozen=True)
class Isolation:
    """Result of the rules on a run."""

    clues: tuple[Clue, ...] = ()
    """Clues in the order of their layers, each with the evidence that it explains."""

    @property
    def strong(self) -> frozenset[Suspect]:
        """Strong suspects of all clues."""
        return frozenset[Suspect]().union(*(clue.strong for clue in self.clues))

    @property
    def weak(self) -> frozenset[Suspect]:
        """Weak suspects that are strong in no clue."""
        return frozenset[Suspect]().union(*(clue.weak for clue in self.clues)) - self.strong


def isolate(signs: RunSigns) -> Isolation:
    """Return the clues of a run; a layer sees only the evidence that the layers before have left unexplained."""
    clues: list[Clue] = []
    for rule in LAYERS:
        for clue in rule(signs):
            explained = frozenset(filter(clue.can_explain, signs.failures.pieces))
            signs = replace(signs, failures=signs.failures.without(explained))
            clues.append(replace(clue, explains=explained))
    shared = frozenset(one for clue in clues for one in clue.strong | clue.weak if one.channel is None)
    return Isolation(tuple(replace(clue, weak=(clue.weak | shared) - clue.strong) for clue in clues))
