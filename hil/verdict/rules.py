"""Where a run's failures come from, and what they leave: rules over the failed checks, in their order.

Bytes and times come first, then what the whole hand shares, then single channels. A rule names a row of
`diagnoses.toml`: the causes that it leaves, and the physical test that splits them.
"""

from __future__ import annotations

import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from aero.channels import Channel
from hil.checks.shared.declaration import Effect
from hil.verdict.diagnosis import Component, Location
from hil.verdict.limits import Key, out_of_limits
from hil.verdict.run_end import EndKind, RunEnd

MANY = 3
"""Channels with one and the same effect from which on the whole hand is asked for its cause first."""
TO_ONE_SIDE = 0.55
"""Mean place of torque readings among healthy ones, from which on all channels lie to one side of them."""
STANDS = 3.0
"""Excess of the way that a channel followed, from which on it did not move at all."""
LABELS = {channel.label: channel for channel in Channel}
THUMB_CABLES = (Channel.THUMB_CMC_FLEXION, Channel.THUMB_FLEXOR)
HAND = Location(Component.HAND)
LESS_TORQUE = {
    "excursion/closed_percent": -1,
    "excursion/fist_travel": -1,
    "staircase/excursion_hand": -1,
    "staircase/tracking_rms": 1,
    "staircase/rise_hand_ms": 1,
    "staircase/spring": 1,
    "replay/replay_delay": 1,
}
"""Readings that too little torque moves, and to which side."""


@dataclass(frozen=True)
class Row:
    """A row of `diagnoses.toml`."""

    causes: tuple[str, ...]
    effects: tuple[Effect, ...]
    test: str
    command: str = ""


@cache
def rows() -> Mapping[str, Row]:
    """Return the diagnoses, by name."""
    text = (resources.files("hil") / "data" / "diagnoses.toml").read_text(encoding="utf-8")
    return {
        name: Row(tuple(row["causes"]), tuple(map(Effect, row["effects"])), row["test"], row.get("command", ""))
        for name, row in tomllib.loads(text).items()
    }


def _key(check: str, subject: str) -> Key:
    experiment, _, metric = check.partition("/")
    return experiment, metric, subject


class Failures:
    """The judged readings of a run."""

    def __init__(self, excesses: Mapping[Key, float], sides: Mapping[Key, float]) -> None:
        """Take readings by their excess (`Limit.excess`) and by their place among healthy ones (`Limit.side`)."""
        self.failed = {key: excess for key, excess in excesses.items() if out_of_limits(excess)}
        self.sides = sides

    def on(self, check: str, sign: int = 0) -> frozenset[Channel]:
        """Return the channels on which a check, `experiment/metric`, failed to one side, to any when 0."""
        return frozenset(
            LABELS[subject]
            for (experiment, metric, subject), excess in self.failed.items()
            if f"{experiment}/{metric}" == check and subject in LABELS and (not sign or excess * sign > 0)
        )

    def hand(self, check: str, sign: int = 0) -> bool:
        """Return whether a check of the whole hand failed to one side, to any when 0."""
        excess = self.failed.get(_key(check, "hand"), 0.0)
        return bool(excess * sign > 0 if sign else excess)

    def excess(self, check: str, channel: Channel) -> float:
        """Return how far a reading of a channel is off; 0 within its limits."""
        return self.failed.get(_key(check, channel.label), 0.0)

    @property
    def channels(self) -> Counter[Channel]:
        """How many checks failed on each channel; motion of *another* encoder counts for none."""
        return Counter(
            LABELS[subject] for _, metric, subject in self.failed if subject in LABELS and metric != "others_moved"
        )

    def weight(self, channel: Channel) -> float:
        """Return how much speaks for a channel: its failed checks, one that is far off for up to three."""
        return sum(
            min(abs(excess), 3.0)
            for (_, metric, subject), excess in self.failed.items()
            if subject == channel.label and metric != "others_moved"
        )


Told = tuple[Location, str]
"""A place, and a row of `diagnoses.toml`; an empty name when nothing known explains it."""


def rule_for(failures: Failures, end: RunEnd) -> Told:
    """Return where something is wrong in a run that failed, and the row that its evidence leaves."""
    return (
        of_the_driver(failures)
        or of_the_bytes(failures, end)
        or of_a_gate(failures)
        or of_exchanged(failures)
        or of_the_times(failures)
        or of_the_hand(failures)
        or of_a_channel(failures)
        or (Location(Component.UNKNOWN), "")
    )


def of_the_driver(failures: Failures) -> Told | None:
    """A check of the driver failed: what the hand reads says nothing then."""
    if any(experiment == "driver" for experiment, _, _ in failures.failed):
        return Location(Component.DRIVER), "driver"
    return None


def of_the_bytes(failures: Failures, end: RunEnd) -> Told | None:
    """Restarts, lost and altered bytes, and the errors that a silent board or link ends a run with."""
    lost = failures.hand("session/lost_replies") or failures.hand("presence/lost_replies")
    stray, broken = failures.hand("session/stray_bytes"), end.kind is EndKind.LINK
    # One servo's readings do not make another's jump.
    jumping = failures.on("staircase/overshoot_hand_percent") | failures.on("holding/creep_percent")
    rules = (
        (end.kind is EndKind.FIRMWARE, Component.BOARD, "firmware_program"),
        (failures.hand("session/restarts"), Component.BOARD, "restarts"),
        (failures.hand("session/unanswered_limits") and not lost, Component.BOARD, "older_firmware"),
        (isinstance(end.error, ConnectionError), Component.LINK, "port_gone"),
        (broken and not stray, Component.BOARD_OR_LINK, "silent"),
        (lost or stray or broken or len(jumping) >= MANY, Component.LINK, "bytes"),
    )
    return _first(rules)


def _first(rules: Iterable[tuple[bool, Component, str]]) -> Told | None:
    return next(((Location(component), row) for holds, component, row in rules if holds), None)


def of_a_gate(failures: Failures) -> Told | None:
    """Temperatures, and a bus on which readings stand still: a gate that fails alone names its sensor."""
    if failures.hand("presence/distinct_readings") or failures.hand("presence/boot_contradictions"):
        return Location(Component.BUS), "bus"
    off = failures.on("presence/temperature")
    if len(off) == 1:
        (channel,) = off
        hot = failures.excess("presence/temperature", channel) > 0
        return Location(Component.CHANNEL, (channel,)), "hot" if hot else "temperature_sensor"
    if len(off) >= MANY:
        return Location(Component.LINK), "bytes"
    return None


def of_exchanged(failures: Failures) -> Told | None:
    """Two channels, or both sides, mixed up."""
    moved = failures.on("audit/others_moved")
    if len(failures.on("audit/followed", -1)) >= MANY or len(failures.on("excursion/stop_current", -1)) >= MANY:
        return Location(Component.BOARD), "other_side"
    if set(THUMB_CABLES) <= failures.channels.keys() and failures.on("excursion/closed_percent", 1) & {
        Channel.THUMB_CMC_FLEXION
    }:
        return Location(Component.CHANNELS, THUMB_CABLES), "exchanged"
    if len(moved) == 2 and failures.on("audit/followed", -1) == moved:
        return Location(Component.CHANNELS, tuple(sorted(moved))), "exchanged"
    return None


def of_the_times(failures: Failures) -> Told | None:
    """What comes late on the whole hand: the link's round trip tells it from the servos."""
    several = len(failures.channels) >= MANY
    late = failures.hand("response/command_to_motion", 1) or len(failures.on("replay/replay_delay", 1)) >= MANY
    lone_telemetry = failures.hand("response/telemetry_period") and not failures.channels
    rules = (
        (failures.hand("presence/round_trip"), Component.LINK, "late_link"),
        (failures.hand("response/backward_readings") and len(failures.channels) != 1, Component.LINK, "bytes"),
        (failures.hand("excursion/stale_readings") and several, Component.LINK, "bytes"),
        (late and not _channels_of(failures, LESS_TORQUE, MANY), Component.HAND, "late_servos"),
        (lone_telemetry, Component.HAND, "late_servos"),
    )
    return _first(rules)


def _channels_of(failures: Failures, checks: Mapping[str, int], least: int) -> bool:
    return any(len(failures.on(check, sign)) >= least for check, sign in checks.items() if "replay" not in check)


def of_the_hand(failures: Failures) -> Told | None:
    """The same effect on three channels, or a little on many to one side: a cause that all share."""
    counted = failures.channels
    if _channels_of(failures, LESS_TORQUE, MANY) or less_torque(failures) >= TO_ONE_SIDE:
        return Location(Component.SUPPLY), "supply"
    if len(counted) >= MANY and min(counted.values()) * 3 >= max(counted.values()):
        return HAND, "supply"
    return None


def less_torque(failures: Failures) -> float:
    """Return how far all channels lie to the side of too little torque, of readings that have one: a mean of places."""
    by_channel: dict[str, list[float]] = defaultdict(list)
    for (experiment, metric, subject), side in failures.sides.items():
        if sign := LESS_TORQUE.get(f"{experiment}/{metric}"):
            by_channel[subject].append(max(-1.0, min(1.0, sign * side)))
    means = sorted(sum(found) / len(found) for found in by_channel.values())
    return means[len(means) // 2] if means else 0.0


def of_a_channel(failures: Failures) -> Told | None:
    """The channel for which most speaks, and what its own checks leave."""
    if failures.channels:
        channel = max(failures.channels, key=lambda one: (failures.weight(one), -one))
        return Location(Component.CHANNEL, (channel,)), what(failures, channel)
    return None


def what(failures: Failures, channel: Channel) -> str:
    """Return the row that the failed checks of one channel leave."""

    def low(check: str) -> bool:
        return failures.excess(check, channel) < 0

    def high(check: str) -> bool:
        return failures.excess(check, channel) > 0

    short = low("excursion/closed_percent") or low("excursion/fist_travel") or low("staircase/excursion_hand")
    unloaded = low("staircase/spring") or low("audit/pull") or low("holding/holding_current")
    loaded = high("staircase/spring") or high("audit/pull") or high("holding/holding_current")
    stands = failures.excess("audit/followed", channel) < -STANDS and short
    rules = (
        (high("staircase/resolution"), "coarse"),
        (stands and (high("presence/idle_current") or high("audit/pull")), "blocked"),
        (stands, "no_power"),
        (high("staircase/overshoot_hand_percent"), "jumping"),
        (high("holding/creep_percent"), "drift"),
        (high("staircase/take_up") and unloaded, "cable_off"),
        (high("presence/idle_current"), "zero"),
        (high("staircase/friction") and not unloaded, "friction"),
        (short and high("staircase/rise_hand_ms"), "slow"),
        (short, "weak"),
        (high("staircase/rise_hand_ms"), "slow"),
        (high("staircase/take_up"), "slack"),
        (unloaded, "spring_weak"),
        (loaded, "spring_strong"),
        (low("staircase/rise_hand_ms"), "fast"),
        (high("excursion/closed_percent"), "stop_moved"),
    )
    return next((row for holds, row in rules if holds), "")
