"""Where a run's failures come from, and what they leave: rules over the failed checks, in their order.

Bytes and times come first, then what the whole hand shares, then single channels. A rule names a row of
`diagnoses.toml`: the causes that it leaves, and the physical test that splits them.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping

from aero.channels import FINGERS, Channel
from aero.errors import DesyncError
from aero.safety import SafetyReason
from hil.verdict.diagnosis import Component, Location
from hil.verdict.limits import Key, out_of_limits
from hil.verdict.run_end import EndKind, RunEnd

MANY = 3
"""Channels with one and the same effect from which on the whole hand is asked for its cause first."""
TO_ONE_SIDE = 0.55
"""Mean place of torque readings among healthy ones, from which on all channels lie to one side of them."""
STANDS = 20.0
"""Excess of the way that a channel followed, from which on it stands: -30 to -88 of dead motors, -6 of a stiff gear."""
LABELS = {channel.label: channel for channel in Channel}
STOPS = {
    SafetyReason.CURRENT: "blocked",
    SafetyReason.CURRENT_AT_REST: "zero",
    SafetyReason.TEMPERATURE: "hot",
    SafetyReason.JUMP: "jumping",
    SafetyReason.STRAY: "stray",
    SafetyReason.MOTION_AT_REST: "stray",
    SafetyReason.STILL_CLOSED: "blocked",
}
"""Row that a stop of the guard leaves where no check says more."""
THUMB_BASE = (Channel.THUMB_ABDUCTION, Channel.THUMB_CMC_FLEXION)
OF_THE_BASE = ("", "zero", "stop_moved")
"""Rows that one of the two may leave for what the other does: they meet in one joint."""
THUMB_CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
STOPS_SHORT = ("excursion/closed_percent", "excursion/fist_travel", "staircase/excursion_hand")
SLOW = ("staircase/tracking_rms", "staircase/rise_hand_ms", "staircase/spring", "replay/replay_delay")
LESS_TORQUE = dict.fromkeys(STOPS_SHORT, -1) | dict.fromkeys(SLOW, 1)
"""Readings that too little torque moves, and to which side."""
LOADS = ("audit/pull", "holding/holding_current", "staircase/friction", "staircase/late_steps")
SHORTER = ("audit/followed", "coupling/stop_abducted", "coupling/stop_without_abduction")
LOADED = LESS_TORQUE | dict.fromkeys(SHORTER, -1) | dict.fromkeys(LOADS, 1)
"""The same, with what else it moves, on a few channels."""
FRICTION = ("friction", "dry_friction", "friction_scatter")
MOVED = "audit/others_moved"


class Failures:
    """The judged readings of a run; `failed` by check, `experiment/metric`, and subject."""

    def __init__(self, excesses: Mapping[Key, float | None], sides: Mapping[Key, float]) -> None:
        """Take readings by their excess (`Limit.excess`) and by their place among healthy ones (`Limit.side`)."""
        # What could not be measured failed to no side, so it speaks for no cause.
        self.failed = {
            (f"{e}/{m}", on): excess
            for (e, m, on), excess in excesses.items()
            if excess is not None and out_of_limits(excess)
        }
        self.sides = sides

    def on(self, check: str, sign: int = 0) -> frozenset[Channel]:
        """Return the channels on which a check failed to one side, to any when 0."""
        return frozenset(
            LABELS[subject]
            for (failed, subject), excess in self.failed.items()
            if failed == check and subject in LABELS and (not sign or excess * sign > 0)
        )

    def hand(self, check: str, sign: int = 0) -> bool:
        """Return whether a check of the whole hand failed to one side, to any when 0."""
        return (check, "hand") in self.failed and (not sign or self.failed[check, "hand"] * sign > 0)

    def excess(self, check: str, channel: Channel) -> float:
        """Return how far a reading of a channel is off; 0 within its limits."""
        return self.failed.get((check, channel.label), 0.0)

    @property
    def channels(self) -> Counter[Channel]:
        """How many checks failed on each channel; motion of *another* encoder counts for none."""
        return Counter(LABELS[subject] for check, subject in self.failed if subject in LABELS and check != MOVED)

    def of_driver(self, *, orderly: bool) -> bool:
        """Return whether the driver sent something else, or misread replies of a link that is in order."""
        return any(check.startswith("driver/") and (orderly or "/read_" not in check) for check, _ in self.failed)

    @property
    def short_of_torque(self) -> bool:
        """Return whether many channels stop short, or fail one other check to the side of too little torque."""
        short = frozenset[Channel]().union(*(self.on(check, -1) for check in STOPS_SHORT))
        slow = (self.on(check, 1) for check in SLOW if "replay" not in check)
        return any(map(many, (short, *slow)))

    def weight(self, one: Channel) -> float:
        """Return how much speaks for a channel: its failed checks, one far off for three; standing still, for all."""
        stands = 99.0 * (self.excess("audit/followed", one) < -STANDS)  # others that lean on it may be further off
        return stands + sum(min(abs(e), 3.0) for (c, on), e in self.failed.items() if on == one.label and c != MOVED)


def many(channels: frozenset[Channel]) -> bool:
    """Return whether so many channels share an effect, and not the thumb's alone, which lean on each other."""
    return len(channels) >= MANY and not channels.isdisjoint(FINGERS)


def rule_for(failures: Failures, end: RunEnd) -> tuple[Location, str]:
    """Return where something is wrong in a run that failed, and the row that its failures leave."""
    return (
        of_the_bytes(failures, end)
        or of_the_bus(failures, end)
        or of_the_hand(failures)
        or of_exchanged(failures)
        or of_a_sensor(failures)
        or of_the_times(failures)
        or of_a_stop(failures, end)
        or of_a_channel(failures)
        or (Location(Component.UNKNOWN), "")
    )


def _first(*rules: tuple[bool, Component, str]) -> tuple[Location, str] | None:
    return next(((Location(component), row) for holds, component, row in rules if holds), None)


def of_the_bytes(failures: Failures, end: RunEnd) -> tuple[Location, str] | None:
    """What the driver sent, restarts, lost and altered bytes, and the errors that a silent board or link ends with."""
    lost = failures.hand("session/lost_replies") or failures.hand("presence/lost_replies")
    stray, restarts, late = map(failures.hand, ("session/stray_bytes", "session/restarts", "presence/round_trip"))
    broken = end.kind is EndKind.LINK or end.stop in {SafetyReason.SILENT, SafetyReason.LINK_LOST}
    # One servo's readings do not make another's jump; motors without torque to spare creep.
    creeping = frozenset[Channel]() if failures.short_of_torque else failures.on("holding/creep_percent")
    jumping = failures.on("staircase/overshoot_hand_percent") | creeping
    return _first(
        # What the hand reads says nothing then.
        (failures.of_driver(orderly=not (lost or stray or restarts)), Component.DRIVER, "driver"),
        (end.kind is EndKind.FIRMWARE, Component.BOARD, "firmware_program"),
        (restarts, Component.BOARD, "restarts"),
        (failures.hand("session/unanswered_limits") and not (lost or late), Component.BOARD, "older_firmware"),
        (end.unanswered_limit and not lost, Component.BOARD, "older_firmware"),
        (isinstance(end.error, ConnectionError), Component.LINK, "port_gone"),
        (broken and not stray and not isinstance(end.error, DesyncError), Component.BOARD_OR_LINK, "silent"),
        (lost or stray or broken or len(jumping) >= MANY, Component.LINK, "bytes"),
        (failures.hand("response/backward_readings") and len(failures.channels) != 1, Component.LINK, "bytes"),
        (failures.hand("staircase/lower_byte") and not failures.channels, Component.LINK, "bytes"),
        (len(failures.on("presence/temperature")) > 1, Component.LINK, "bytes"),
    )


def of_the_bus(failures: Failures, end: RunEnd) -> tuple[Location, str] | None:
    """Readings that stand still on all channels, at rest or on their way: a silent servo, or a link that repeats."""
    gone = failures.hand("presence/distinct_readings") or failures.hand("presence/boot_contradictions")
    late = failures.hand("presence/round_trip") or failures.hand("response/telemetry_period", 1)
    still = failures.on("excursion/stale") | failures.on("response/standstill") | failures.on("staircase/late_steps")
    shared = failures.hand("excursion/stale_readings") or failures.hand("response/longest_standstill")
    others = len(failures.on("replay/replay_shape")) >= MANY or len(still) > 1
    return _first(
        (end.stop is SafetyReason.UNWATCHED, Component.HOST, "held_up"),
        (gone or end.stop is SafetyReason.STALE, Component.LINK, "bus"),
        (shared and others and not failures.short_of_torque, Component.LINK, "repeats"),
        (late, Component.LINK, "late_link"),
        # A motor without torque to spare begins a step late, too.
        (len(failures.on("staircase/late_steps")) >= MANY and not failures.short_of_torque, Component.LINK, "bytes"),
    )


def of_the_hand(failures: Failures) -> tuple[Location, str] | None:
    """The same effect on three channels, or a little on many to one side: a cause that all share."""
    slow = failures.sides.get(("response", "open_close_rate", "hand"), 0.0) < -1.0
    # Too little torque of all leaves each finger as fast as its neighbours, and loads more than one channel.
    alike = all(failures.sides.get(("alike", n, f.label), 0.0) < 1.0 for n in ("rise", "opening") for f in FINGERS)
    loads = all(excess * LOADED.get(check, 0) > 0 for (check, on), excess in failures.failed.items() if on in LABELS)
    one = len(failures.channels) == 1 and (failures.on("staircase/spring", 1) or failures.on("staircase/friction", 1))
    pulled = failures.on("audit/pull", 1) & failures.on("audit/followed", -1)
    return _first(
        (failures.short_of_torque, Component.SUPPLY, "supply"),
        (len(pulled) >= MANY - 1 and Channel.THUMB_FLEXOR in pulled, Component.SUPPLY, "supply"),
        (slow and alike and loads and not one, Component.SUPPLY, "supply"),
        (less_torque(failures) >= TO_ONE_SIDE, Component.SUPPLY, "supply"),
    )


def less_torque(failures: Failures) -> float:
    """Return how far the channels lie to the side of too little torque: the median of their mean places."""
    by_channel: dict[str, list[float]] = defaultdict(list)
    for (experiment, metric, subject), side in failures.sides.items():
        if sign := LESS_TORQUE.get(f"{experiment}/{metric}"):
            by_channel[subject].append(max(-1.0, min(1.0, sign * side)))
    means = sorted(sum(found) / len(found) for found in by_channel.values())
    return means[len(means) // 2] if len(means) > MANY else 0.0


def of_exchanged(failures: Failures) -> tuple[Location, str] | None:
    """Two channels, or both sides, mixed up."""
    closed, shape, moved = "excursion/closed_percent", "staircase/spring_shape", failures.on(MOVED)
    if many(failures.on("audit/followed")) or many(failures.on("excursion/stop_current", -1)):
        return Location(Component.BOARD), "other_side"
    # Each finger's load grows in a way of its own.
    opposite = len(failures.failed) == 2 and failures.on(shape, 1) and failures.on(shape, -1)
    two = moved if failures.on("audit/followed", -1) & moved else failures.on(shape) if opposite else frozenset()
    further = failures.on(closed, 1) >= {Channel.THUMB_CMC_FLEXION} and Channel.THUMB_FLEXOR in failures.on(closed, -1)
    two = two if len(two) == 2 else frozenset(THUMB_CABLES) if further else frozenset()
    return (Location(Component.CHANNELS, tuple(sorted(two))), "exchanged") if two else None


def of_a_sensor(failures: Failures) -> tuple[Location, str] | None:
    """One channel's temperature is off, and no other channel fails: its temperature sensor."""
    off = failures.on("presence/temperature") | failures.on("alike/temperature") | failures.on("alike/warmed")
    if len(off) != 1 or len(failures.channels) > 1:
        return None
    hot = any(failures.on(check, 1) for check in ("presence/temperature", "alike/temperature"))
    return Location(Component.CHANNEL, tuple(off)), "hot" if hot else "temperature_sensor"


def of_the_times(failures: Failures) -> tuple[Location, str] | None:
    """What comes late on the whole hand, and by no lack of torque."""
    # A channel that does not move, or jumps, leaves no time to measure.
    spoilt = failures.on("audit/followed", -1) | failures.on("staircase/overshoot_hand_percent")
    slow_start = failures.hand("response/command_to_motion", 1) and not spoilt
    late = slow_start or len(failures.on("replay/replay_delay", 1)) >= MANY
    soft = many(failures.on("excursion/closed_percent")) or many(failures.on("staircase/excursion_hand"))
    return _first((late, Component.HAND, "late_servos"), (soft, Component.HAND, "cables_soft"))


def of_a_stop(failures: Failures, end: RunEnd) -> tuple[Location, str] | None:
    """The guard stopped the hand for one channel: its kind of stop tells what little was seen."""
    if end.channel is None or end.stop not in STOPS:
        return None
    return Location(Component.CHANNEL, (end.channel,)), what(failures, end.channel) or STOPS[end.stop]


def of_a_channel(failures: Failures) -> tuple[Location, str] | None:
    """The channel for which most speaks, and what its own checks leave."""
    behind = [one for one in FINGERS if failures.sides.get(("response", "standstill", one.label), 0.0) > 1.0]
    if not failures.channels:
        # A reading of the hand goes to the finger that alone shows it.
        shown = len(behind) == 1 and failures.hand("response/longest_standstill")
        return (Location(Component.CHANNEL, tuple(behind)), "answers") if shown else None
    channel = max(failures.channels, key=lambda one: (failures.weight(one), -one))
    row = what(failures, channel)
    on = THUMB_BASE if row in OF_THE_BASE and channel in THUMB_BASE else (channel,)
    return Location(Component.CHANNELS if on is THUMB_BASE else Component.CHANNEL, on), row


def what(failures: Failures, channel: Channel) -> str:
    """Return the row that the failed checks of one channel leave."""

    def low(*checks: str) -> bool:
        return any(failures.excess(check, channel) < 0 for check in checks)

    def high(*checks: str) -> bool:
        return any(failures.excess(check, channel) > 0 for check in checks)

    short = low("excursion/closed_percent", "excursion/fist_travel", "staircase/excursion_hand")
    further = high("excursion/closed_percent", "coupling/stop_without_abduction")
    unloaded = low("staircase/spring", "audit/pull", "holding/holding_current")
    loaded = high("staircase/spring", "audit/pull", "holding/holding_current")
    slow = high("staircase/rise_hand_ms", "alike/rise", "alike/opening")
    closed = any(experiment == "excursion" for experiment, _, _ in failures.sides)
    stands = failures.excess("audit/followed", channel) < -STANDS and (short or not closed)
    rubs = max(failures.excess(f"staircase/{name}", channel) for name in FRICTION)
    rules = (
        (stands and (high("audit/pull") or high("presence/idle_current")), "blocked"),
        (stands, "no_power"),
        (high("staircase/resolution"), "coarse"),
        (high("staircase/overshoot_hand_percent"), "jumping"),
        (high(MOVED) and channel in THUMB_CABLES, "stop_moved"),
        (high("holding/creep_percent") and high("staircase/tracking_rms"), "cuts_out"),
        (high("holding/creep_percent") or (low("alike/held_again") or high("alike/held_again")), "drift"),
        (high("response/standstill", "excursion/stale") and not short, "answers"),
        (high("staircase/take_up") and high("staircase/spring_shape"), "slack"),
        (unloaded and (further or high("audit/followed")), "cable_off"),
        ((unloaded and low("excursion/stop_current")) or (loaded and high("excursion/stop_current")), "current_sensor"),
        (high("staircase/take_up") and low("staircase/spring"), "cable_off"),
        (high("presence/idle_current") and not low("audit/followed"), "zero"),
        (unloaded, "spring_weak"),
        (short and slow, "slow"),
        # Friction adds to the current of closing what it takes from that of opening: between them nothing changes.
        (not short and failures.excess("staircase/spring", channel) > rubs, "joint"),
        (rubs > 0 or low("audit/followed"), "friction"),
        (high("staircase/take_up") and not loaded, "slack"),
        (short and loaded, "spring_strong"),
        (short, "weak"),
        (loaded, "joint"),
        (low("alike/rise", "alike/opening", "staircase/rise_hand_ms"), "fast"),
        (slow, "slow"),
        (low("staircase/spring_shape") or high("staircase/spring_shape", "staircase/load_jump"), "joint"),
        (further or low("coupling/stop_shift"), "stop_moved"),
        (low("excursion/stop_current") or high("excursion/stop_current"), "current_sensor"),
    )
    return next((row for holds, row in rules if holds), "")
