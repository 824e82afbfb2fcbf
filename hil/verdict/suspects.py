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
The rules are therefore in layers, in this order: driver, link, freshness, setting, mechanics. The first layer with a
matching rule explains the run. Later layers add the parts shared by all digits as weak suspects, which replace the
strong ones after steps have cleared these.

Strong and weak. A rule yields a `Clue`: its observation, the parts that usually cause it (*strong*) and the parts that
may cause it (*weak*). The group is every strong suspect of the explaining layer. A long list is safe: a step that ends
the failure clears all others at once, and only a part that a step has shown is convicted.

Sharing. Digits share only supply, board, bus and set-up; the three channels of the thumb are coupled and count as one
unit. Evidence on more than two units points to shared parts. Of two units the one with more kinds of evidence is
suspected; two units with equal kinds may touch, be exchanged, or share a weak supply.

A single fault is assumed. A second one leaves the case open, or leaves failing checks after the first is repaired.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from aero.channels import FINGERS, Channel
from aero.errors import DesyncError, NoTelemetryError
from aero.safety import SafetyReason
from hil.checks.shared.declaration import EvidenceKind as Kind
from hil.checks.shared.subjects import SUBJECTS, subject_words
from hil.verdict.failures import LABELS, Failures
from hil.verdict.part import Part
from hil.verdict.parts import Suspect, listed
from hil.verdict.run_end import EndKind, RunEnd

PAIR = 2
"""Limit of failing units for a cause between two units, such as an exchange or contact."""
THUMB = frozenset({Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR})
IN_MOTION = frozenset({Kind.TIME, Kind.STALE, Kind.JUMP, Kind.SPEED})
"""Kinds of evidence that neither a static load nor a wrong zero causes."""
EVERYWHERE = frozenset(SUBJECTS)


@dataclass(frozen=True)
class Clue:
    """Conclusion of one rule."""

    seen: str
    """Observation as a sentence without a full stop."""
    strong: frozenset[Suspect]
    """Parts that usually cause the observation."""
    weak: frozenset[Suspect] = frozenset()
    """Parts that may cause the observation."""
    explains: frozenset[str] = EVERYWHERE
    """Subjects whose failures the clue explains."""


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
        yield Clue(f"no answer from the servo of the {names}", _of(signs.silent, Part.SERVO) | _hand(Part.BUS))
    elif isinstance(signs.end.error, NoTelemetryError):
        silent = _hand(Part.BUS, Part.SERVO, Part.SUPPLY, Part.BOARD)
        yield Clue("the board has never read all servos since its start", silent, _hand(Part.SETUP))
    elif signs.end.stop is SafetyReason.STALE or (Kind.STALE in hand):
        yield Clue("no reading changes", _hand(Part.BUS, Part.SERVO, Part.BOARD, Part.USB), _hand(Part.SUPPLY))
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
    if len(units) > PAIR or _alike(signs):
        yield _several()
    elif len(units) == PAIR == len(leading):
        yield _pair(signs)
    elif units:
        others = frozenset().union(*units) - leading[0]
        for channel in _leaning(signs, leading[0]):
            yield _one(signs, channel, others)
    elif Kind.SPEED in signs.hand or Kind.TIME in signs.hand:
        yield Clue("the whole hand is slow", _hand(Part.SUPPLY, Part.SETUP, Part.BOARD, Part.USB))
    if crossed := {LABELS[one.subject] for one in signs.failures.pieces if one.kind is Kind.CROSSED}:
        two = crossed | signs.of_channels.keys() if len(units) <= PAIR else crossed
        shared = _hand(Part.BOARD, Part.DRIVER, Part.SETUP)
        yield Clue("an encoder moves with another channel's command", _of(two, Part.SERVO) | shared)


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


def _pair(signs: RunSigns) -> Clue:
    two = frozenset(signs.of_channels)
    names = " and the ".join(subject_words(one.label) for one in sorted(two))
    strong = _of(two, Part.SERVO, Part.DIGIT) | _hand(Part.SETUP, Part.SUPPLY, Part.BOARD)
    explains = frozenset(one.label for one in two) | {"hand"}
    weak = _hand(Part.BUS, Part.DRIVER, Part.COMPUTER)
    return Clue(f"readings of the {names} are off", strong, weak, explains)


def _one(signs: RunSigns, channel: Channel, others: frozenset[Channel]) -> Clue:
    """Return the clue of the evidence on one channel."""
    kinds = signs.of_channels.get(channel, frozenset({Kind.TRAVEL}))
    own, place = _of([channel], Part.SERVO), _of([channel], Part.DIGIT)
    # another program on the computer may command the hand as well
    shared = _hand(Part.BOARD, Part.SUPPLY, Part.DRIVER, Part.COMPUTER)
    if kinds == {Kind.OWN_SENSOR}:
        strong, weak = own, place | _hand(Part.SETUP, Part.BUS) | shared
    elif kinds <= IN_MOTION:
        strong, weak = own | _hand(Part.BUS, Part.BOARD), place | _hand(Part.SETUP, Part.USB) | shared
    else:
        strong, weak = own | place | _hand(Part.SETUP), _hand(Part.BUS) | shared
    lean = frozenset(one.label for one in THUMB) if channel in THUMB else frozenset[str]()
    explains = lean | {channel.label, "hand"} | frozenset(one.label for one in others)
    if Kind.SPEED in signs.hand:
        # a weak supply fails first at the digit with the largest load, and slows the others
        strong |= _hand(Part.SUPPLY)
    weak |= _of(others | (THUMB - {channel} if channel in THUMB else frozenset()), Part.SERVO, Part.DIGIT)
    return Clue(f"readings of the {subject_words(channel.label)} are off", strong, weak, explains)


LAYERS: tuple[Rule, ...] = (driver, link, fresh, setting, mechanics)
"""Rules, one per layer, ordered so that each layer's measurements presuppose the layers before."""


@dataclass(frozen=True)
class Isolation:
    """Result of the rules on a run."""

    clues: tuple[Clue, ...] = ()
    """Clues of the explaining layer."""
    strong: frozenset[Suspect] = frozenset()
    weak: frozenset[Suspect] = frozenset()

    @property
    def group(self) -> frozenset[Suspect]:
        """Ambiguity group: strong suspects, else weak ones."""
        return self.strong or self.weak


def isolate(signs: RunSigns) -> Isolation:
    """Return the suspects of a run."""
    layers = [found for rule in LAYERS if (found := tuple(rule(signs)))]
    if not layers:
        return Isolation()
    first, *later = layers
    strong = frozenset[Suspect]().union(*(clue.strong for clue in first))
    weak = frozenset[Suspect]().union(*(clue.weak for clue in first))
    others = frozenset[Suspect]().union(*(clue.strong | clue.weak for found in later for clue in found))
    return Isolation(first, strong, (weak | {one for one in others if one.channel is None}) - strong)
