"""What a policy observes and what its action means, declared in one TOML file beside it.

    rate_hz = 20.0
    torque_limit = 0.5                    # share of the stall torque; left out for the firmware's own

    [[observation]]                       # in this order, one after another
    field = "lengths"                     # one of Field
    channels = ["index", "thumb_flexor"]  # order; all seven, command order, when left out
    scale = 1.0                           # (value - offset) * scale; one number or one a channel
    offset = 0.0
    history = 1                           # periods, the oldest first

    [action]
    field = "lengths"                     # one of MEANINGS
    channels = ["index", "thumb_flexor"]  # what is not named stays at its nominal value
    nominal = [...]                       # (7,), command order: the grasp, action zero
    scale = [...]                         # one number or one an action: change from action 0 to 1
    clip = 1.0                            # beyond it an action is cut off

`aero/policy/shipped/steady.toml` is an example.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.actuation.map import ActuationMap
from aero.channels import OBSERVATION_ORDER, Channel
from aero.exit_code import Exit
from aero.policy.settings import MOST_TARGET, PolicySettings, checked_number
from aero.policy.task import ACTION_SIZE, CHANNELS, ShownAction
from aero.regular_file import read_toml

Floats = NDArray[np.float64]
Row = tuple[float, ...]
COMMAND_ORDER = tuple(Channel)
MOST_PERIODS = 1000
"""Longest history, periods."""
MOST_PARTS = 100
"""Largest number of parts of an observation."""
MOST_SCALE = 1e6
"""Largest factor and offset of an observed value."""
MOST_CLIP = 100.0
"""Largest action; none is longer than its scale times this."""


class PolicyFileError(ValueError):
    """A policy that this project cannot run as it was meant."""

    exit_code = Exit.USAGE


class Moment(NamedTuple):
    """One control period as it can be observed; arrays are (7,), command order."""

    lengths: Floats
    """Measured, correction taken off, m, abduction rad."""
    currents: Floats
    """Of the period before, A; zero at first."""
    last_action: Floats
    """The action that led here, of the channels that the policy acts on; zero at first."""
    action_before_last: Floats
    """The one before it."""


class Field(Enum):
    """What can be observed, and how it is had of a moment."""

    LENGTHS = "lengths"
    """Cables, m (longer is more open), abduction rad."""
    ANGLES = "angles"
    """One angle for all joints on a cable, rad: 0 for the extended hand. Made of the lengths, which the map fits: the
    thumb's flexion is off by up to 0.4° at the base and 1.9° beyond it."""
    CURRENTS = "currents"
    """Motor currents of the period before, A."""
    LAST_ACTION = "last_action"
    """The action that led to the measured lengths."""
    ACTION_BEFORE_LAST = "action_before_last"
    """The one before it."""

    def of(self, moment: Moment, codec: ActuationMap) -> Floats:
        """Return the values, (7,), command order."""
        if self is Field.ANGLES:
            angles: Floats = codec.compact_from_travel(codec.travel_from_lengths(moment.lengths))
            return angles
        values: Floats = getattr(moment, self.value)
        return values


MEANINGS = (Field.LENGTHS, Field.ANGLES)
"""What an action may be, after nominal and scale."""


@dataclass(frozen=True)
class Observed:
    """One part of the observation.

    Raises:
        ValueError: values that are not finite, do not fit the channels, or a history below 1.
    """

    field: Field
    channels: tuple[Channel, ...] = COMMAND_ORDER
    scale: Row = (1.0,)
    """What is observed is (value - offset) * scale: one number, or one a channel."""
    offset: Row = (0.0,)
    history: int = 1
    """Periods, the oldest first."""

    def __post_init__(self) -> None:
        if not isinstance(self.history, int) or not 1 <= self.history <= MOST_PERIODS:
            raise ValueError(f"history must be a whole number from 1 to {MOST_PERIODS}, got {self.history}")
        for name in ("scale", "offset"):
            _check_row(name, getattr(self, name), len(self.channels), most=MOST_SCALE)

    @property
    def size(self) -> int:
        """How many numbers it is."""
        return self.history * len(self.channels)


@dataclass(frozen=True)
class Action:
    """What the policy's output means.

    Raises:
        ValueError: values that are not finite, do not fit the channels, or a clip that is not positive.
    """

    nominal: Row
    """(7,), command order, in the units of `meaning`."""
    scale: Row
    """One number, or one an action."""
    meaning: Field = Field.LENGTHS
    """One of `MEANINGS`."""
    channels: tuple[Channel, ...] = COMMAND_ORDER
    clip: float = 1.0

    def __post_init__(self) -> None:
        checked_number("clip", self.clip, above=0.0, most=MOST_CLIP)
        _check_row("scale", self.scale, len(self.channels), most=MOST_TARGET)
        if len(self.nominal) != CHANNELS:
            raise ValueError(f"nominal needs {CHANNELS} values in command order, got {len(self.nominal)}")
        _check_row("nominal", self.nominal, CHANNELS, most=MOST_TARGET)

    def cut_off(self, output: Floats) -> bool:
        """Return whether the policy's output (n,) goes beyond the clip."""
        return bool((np.abs(output) > self.clip).any())

    def bounded(self, output: Floats) -> Floats:
        """Return the policy's output (n,) as the action of every channel, (7,), zero where it has none."""
        action = np.zeros(CHANNELS)
        action[np.array(self.channels)] = np.clip(output, -self.clip, self.clip)
        return action

    def target(self, action: Floats, codec: ActuationMap) -> Floats:
        """Return the lengths that `action` (7,) asks for, (7,), m, abduction rad."""
        scale = np.zeros(CHANNELS)
        scale[np.array(self.channels)] = self.scale
        values: Floats = np.array(self.nominal) + scale * action
        if self.meaning is Field.ANGLES:
            values = codec.lengths_from_travel(codec.travel_from_joints(codec.joints_from_compact(values)))
        return values


@dataclass(frozen=True)
class Interface:
    """What a policy observes, in order, and what its action means."""

    observation: tuple[Observed, ...]
    action: Action
    rate_hz: float = 20.0
    torque_limit: float | None = None
    """Share of its stall torque that a servo may use; None for the firmware's own limit."""

    @property
    def observation_size(self) -> int:
        """How many numbers the policy observes."""
        return sum(part.size for part in self.observation)

    @property
    def action_size(self) -> int:
        """How many numbers it returns."""
        return len(self.action.channels)

    def settings(self) -> PolicySettings:
        """Return nominal grasp and reach in lengths, rate and torque limit: what runs and records a policy.

        Raises:
            ValueError: a rate or a torque limit that cannot be used.
        """
        codec, action = ActuationMap(), self.action
        nominal = action.target(np.zeros(ACTION_SIZE), codec)
        ends = [action.target(action.clip * one, codec) - nominal for one in np.eye(ACTION_SIZE)]
        reach = np.abs(ends).sum(axis=0)  # both meanings are affine, so no action goes further than the sum
        return PolicySettings(
            nominal=tuple(nominal.tolist()),
            scale=tuple(np.maximum(reach, np.finfo(float).tiny).tolist()),
            control_rate_hz=self.rate_hz,
            torque_limit=self.torque_limit,
        )

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read one from a TOML file.

        Raises:
            PolicyFileError: no such file, or something in it that is unknown, missing or does not fit; one line.
        """
        try:
            return cls._parsed(read_toml(path))
        except FileNotFoundError as error:
            raise PolicyFileError(
                f"{path} is missing: it says what the policy observes and what its action means; copy "
                "aero/policy/shipped/steady.toml and change it"
            ) from error
        except (OSError, ValueError, TypeError, KeyError, OverflowError) as error:
            said = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
            raise PolicyFileError(f"{path}: {said}") from error

    @classmethod
    def _parsed(cls, table: Mapping[str, Any]) -> Self:
        _check_names("the file", table, {"observation", "action", "rate_hz", "torque_limit"})
        parts = []
        for row in table["observation"]:
            _check_names("an observation", row, {"field", "channels", "scale", "offset", "history"})
            scale, offset = _row(row.get("scale", 1.0)), _row(row.get("offset", 0.0))
            parts.append(Observed(_one(Field, row["field"]), _channels(row), scale, offset, row.get("history", 1)))
        row = table["action"]
        _check_names("the action", row, {"field", "channels", "nominal", "scale", "clip"})
        action = Action(
            _row(row["nominal"]), _row(row["scale"]), _one(MEANINGS, row["field"]), _channels(row),
            float(row.get("clip", 1.0)),
        )  # fmt: skip
        limit = table.get("torque_limit")
        made = cls(tuple(parts), action, float(table["rate_hz"]), None if limit is None else float(limit))
        made.settings()  # refuses a rate or a limit out of range
        if not 1 <= len(parts) <= MOST_PARTS:
            raise ValueError(f"an observation has 1 to {MOST_PARTS} parts, got {len(parts)}")
        return made


class History:
    """What a policy has seen in one run, and what it observes now."""

    def __init__(self, interface: Interface, codec: ActuationMap) -> None:
        """Begin a run; `codec` makes angles of lengths."""
        self._parts, self._codec = interface.observation, codec
        longest = max(part.history for part in self._parts)
        self._moments: deque[Moment] = deque(maxlen=longest)
        self._actions = (np.zeros(CHANNELS), np.zeros(CHANNELS))
        self._currents = np.zeros(CHANNELS)

    def observe(self, lengths: Floats) -> Floats:
        """Return the observation (n,) once `lengths` (7,) are read; before the first period the first one counts."""
        self._moments.append(Moment(lengths, self._currents, *self._actions))
        while len(self._moments) < (self._moments.maxlen or 1):
            self._moments.appendleft(self._moments[0])
        rows = []
        for part in self._parts:
            for moment in list(self._moments)[-part.history :]:
                values = part.field.of(moment, self._codec)[np.array(part.channels)]
                rows.append((values - np.array(part.offset)) * np.array(part.scale))
        return np.concatenate(rows)

    def acted(self, action: Floats) -> None:
        """Note the action (7,) of this period."""
        self._actions = (action, self._actions[0])

    def drew(self, currents: Floats) -> None:
        """Note the currents (7,) of this period, A; a missing reading leaves the one before."""
        if np.isfinite(currents).all():
            self._currents = currents


class Acting(Protocol):
    """What turns observations into actions."""

    def act(self, observation: ArrayLike) -> NDArray[Any]:
        """Return the action (m,) for an observation (n,)."""
        ...


def cube_interface(settings: PolicySettings, shown_action: ShownAction) -> Interface:
    """Return what every policy of the cube task observes and does."""
    shown = {ShownAction.LAST: Field.LAST_ACTION, ShownAction.BEFORE_LAST: Field.ACTION_BEFORE_LAST}[shown_action]
    return Interface(
        (Observed(Field.LENGTHS, OBSERVATION_ORDER), Observed(shown)),
        Action(settings.nominal, settings.scale),
        settings.control_rate_hz,
        settings.torque_limit,
    )


def _check_names(where: str, table: Mapping[str, Any], known: set[str]) -> None:
    if unknown := sorted(set(table) - known):
        raise ValueError(f"{where} knows no {', '.join(unknown)}; it has {', '.join(sorted(known))}")


def _check_row(name: str, row: Row, size: int, *, most: float) -> None:
    if len(row) not in (1, size):
        raise ValueError(f"{name} needs one number or {size}, got {len(row)}")
    for value in row:
        checked_number(name, value, least=-most, most=most)


def _row(value: float | list[float]) -> Row:
    return tuple(float(one) for one in (value if isinstance(value, list) else [value]))


def _one(fields: Iterable[Field], name: str) -> Field:
    names = {field.value: field for field in fields}
    if name not in names:
        raise ValueError(f"there is no field {name!r}; there are {', '.join(names)}")
    return names[name]


def _channels(row: Mapping[str, Any]) -> tuple[Channel, ...]:
    by_label = {channel.label: channel for channel in Channel}
    labels = row.get("channels", list(by_label))
    if unknown := [label for label in labels if label not in by_label]:
        raise ValueError(f"there is no channel {unknown[0]!r}; there are {', '.join(by_label)}")
    if not labels or len(set(labels)) != len(labels):
        raise ValueError(f"channels must be named once each, got {labels}")
    return tuple(by_label[label] for label in labels)
