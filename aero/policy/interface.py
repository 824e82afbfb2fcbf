"""Interface of a policy (observation and action), declared in a TOML file beside the policy.

    rate_hz = 20.0
    torque_limit = 0.5                    # fraction of the stall torque; without it the firmware's limit

    [[observation]]                       # in this order, one after another
    field = "lengths"                     # one of Field
    channels = ["index", "thumb_flexor"]  # order; without it all seven in command order
    scale = 1.0                           # (value - offset) * scale; one number or one a channel
    offset = 0.0
    history = 1                           # periods, the oldest first

    [action]
    field = "lengths"                     # one of MEANINGS
    channels = ["index", "thumb_flexor"]  # all other channels keep their nominal value
    nominal = [...]                       # (7,), command order: the grasp, action zero
    scale = [...]                         # one number or one an action: change from action 0 to 1
    clip = 1.0                            # actions are clipped to -clip..clip

`aero/policy/shipped/steady.toml` is an example.
"""

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
from aero.floats import Floats
from aero.policy.settings import MOST_TARGET, PolicySettings, checked_number
from aero.policy.task import ACTION_SIZE, CHANNELS, ShownAction
from aero.regular_file import read_toml

Row = tuple[float, ...]
COMMAND_ORDER = tuple(Channel)
MOST_PERIODS = 1000
MOST_PARTS = 100
MOST_SCALE = 1e6
"""Largest factor and offset of an observed value."""
MOST_CLIP = 100.0


class PolicyFileError(ValueError):
    """A policy that this project cannot run as intended."""

    exit_code = Exit.USAGE


class Moment(NamedTuple):
    """Observable quantities of one control period; arrays are (7,), command order."""

    lengths: Floats
    """Measured lengths minus the correction, m, abduction rad."""
    currents: Floats
    """Currents of the previous period, A; zeros at the start."""
    last_action: Floats
    """Previous action, on the policy's channels; zeros at the start."""
    action_before_last: Floats
    """Action before `last_action`; zeros at the start."""


class Field(Enum):
    """Observable quantity of a `Moment`."""

    LENGTHS = "lengths"
    """Cable lengths, m (longer is more open), abduction rad."""
    ANGLES = "angles"
    """Angle of all joints on a cable, rad; 0 is the extended hand. Estimated from lengths by the map; thumb flexion
    is in error by up to 0.4° at the base and 1.9° distally."""
    CURRENTS = "currents"
    """Motor currents of the previous period, A."""
    LAST_ACTION = "last_action"
    """Action that led to the measured lengths."""
    ACTION_BEFORE_LAST = "action_before_last"

    def of(self, moment: Moment, codec: ActuationMap) -> Floats:
        """Return this quantity of `moment`, (7,), command order."""
        if self is Field.ANGLES:
            angles: Floats = codec.compact_from_travel(codec.travel_from_lengths(moment.lengths))
            return angles
        values: Floats = getattr(moment, self.value)
        return values


MEANINGS = (Field.LENGTHS, Field.ANGLES)
"""Quantities that an action can target, after nominal and scale."""


@dataclass(frozen=True)
class Observed:
    """One `[[observation]]` part.

    Raises:
        ValueError: values not finite or not fitting the channels, or a history below 1.
    """

    field: Field
    channels: tuple[Channel, ...] = COMMAND_ORDER
    scale: Row = (1.0,)
    """Factor in (value - offset) * scale: one number, or one a channel."""
    offset: Row = (0.0,)
    history: int = 1
    """Number of periods, the oldest first."""

    def __post_init__(self) -> None:
        if not isinstance(self.history, int) or not 1 <= self.history <= MOST_PERIODS:
            raise ValueError(f"history must be a whole number from 1 to {MOST_PERIODS}, got {self.history}")
        for name in ("scale", "offset"):
            _check_row(name, getattr(self, name), len(self.channels), most=MOST_SCALE)

    @property
    def size(self) -> int:
        """Number of values."""
        return self.history * len(self.channels)


@dataclass(frozen=True)
class Action:
    """Mapping from the policy's output to channel targets.

    Raises:
        ValueError: values not finite or not fitting the channels, or a clip that is not positive.
    """

    nominal: Row
    """Targets at action zero, (7,), command order, in the units of `meaning`."""
    scale: Row
    """Change of the target from action 0 to 1: one number, or one an action."""
    meaning: Field = Field.LENGTHS
    """Quantity targeted by the action, one of `MEANINGS`."""
    channels: tuple[Channel, ...] = COMMAND_ORDER
    clip: float = 1.0

    def __post_init__(self) -> None:
        checked_number("clip", self.clip, above=0.0, most=MOST_CLIP)
        _check_row("scale", self.scale, len(self.channels), most=MOST_TARGET)
        if len(self.nominal) != CHANNELS:
            raise ValueError(f"nominal needs {CHANNELS} values in command order, got {len(self.nominal)}")
        _check_row("nominal", self.nominal, CHANNELS, most=MOST_TARGET)

    def cut_off(self, output: Floats) -> bool:
        """Return whether the policy's output (n,) exceeds the clip."""
        return bool((np.abs(output) > self.clip).any())

    def bounded(self, output: Floats) -> Floats:
        """Return the clipped policy output (n,) as an action of all channels, (7,), zero on the others."""
        action = np.zeros(CHANNELS)
        action[np.array(self.channels)] = np.clip(output, -self.clip, self.clip)
        return action

    def target(self, action: Floats, codec: ActuationMap) -> Floats:
        """Return the target lengths of `action` (7,): (7,), m, abduction rad."""
        scale = np.zeros(CHANNELS)
        scale[np.array(self.channels)] = self.scale
        values: Floats = np.array(self.nominal) + scale * action
        if self.meaning is Field.ANGLES:
            values = codec.lengths_from_travel(codec.travel_from_joints(codec.joints_from_compact(values)))
        return values


@dataclass(frozen=True)
class Interface:
    """Observation parts, in order, and action of a policy."""

    observation: tuple[Observed, ...]
    action: Action
    rate_hz: float = 20.0
    torque_limit: float | None = None
    """Torque limit of every servo, fraction of its stall torque; None for the firmware's limit."""

    @property
    def observation_size(self) -> int:
        """Number of values in an observation."""
        return sum(part.size for part in self.observation)

    @property
    def action_size(self) -> int:
        """Number of values in an action."""
        return len(self.action.channels)

    def settings(self) -> PolicySettings:
        """Return the equivalent settings for running and recording: nominal grasp and reach as lengths, rate, limit.

        Raises:
            ValueError: rate or torque limit out of range.
        """
        codec, action = ActuationMap(), self.action
        nominal = action.target(np.zeros(ACTION_SIZE), codec)
        ends = [action.target(action.clip * one, codec) - nominal for one in np.eye(ACTION_SIZE)]
        reach = np.abs(ends).sum(axis=0)  # both meanings are affine, so the sum bounds every action
        return PolicySettings(
            nominal=tuple(nominal.tolist()),
            scale=tuple(np.maximum(reach, np.finfo(float).tiny).tolist()),
            control_rate_hz=self.rate_hz,
            torque_limit=self.torque_limit,
        )

    @classmethod
    def load(cls, path: Path) -> Self:
        """Read an interface from a TOML file.

        Raises:
            PolicyFileError: missing file, or an unknown, missing or invalid entry; a message of one line.
        """
        try:
            return cls._parsed(read_toml(path))
        except FileNotFoundError as error:
            raise PolicyFileError(
                f"{path} is missing: it declares observation and action of the policy; copy "
                "aero/policy/shipped/steady.toml and change it"
            ) from error
        except (OSError, ValueError, TypeError, KeyError, OverflowError) as error:
            said = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
            raise PolicyFileError(f"{path}: {said}") from error

    @classmethod
    def _parsed(cls, table: Mapping[str, Any]) -> Self:
        _check_names("the file", table, {"observation", "action", "rate_hz", "torque_limit"})
        parts = []
        if not isinstance(table["observation"], list):
            raise ValueError("the parts of an observation are tables under [[observation]], with two brackets")
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
    """Buffer of past periods in one run, from which observations are assembled."""

    def __init__(self, interface: Interface, codec: ActuationMap) -> None:
        """Start with an empty buffer; `codec` converts lengths to angles."""
        self._parts, self._codec = interface.observation, codec
        longest = max(part.history for part in self._parts)
        self._moments: deque[Moment] = deque(maxlen=longest)
        self._actions = (np.zeros(CHANNELS), np.zeros(CHANNELS))
        self._currents = np.zeros(CHANNELS)

    def observe(self, lengths: Floats) -> Floats:
        """Add measured `lengths` (7,) and return the observation (n,); missing history repeats the first period."""
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
        """Record the action (7,) of this period."""
        self._actions = (action, self._actions[0])

    def drew(self, currents: Floats) -> None:
        """Record the currents (7,) of this period, A; a missing reading keeps the previous currents."""
        if np.isfinite(currents).all():
            self._currents = currents


class Acting(Protocol):
    """Function from observations to actions."""

    def act(self, observation: ArrayLike) -> NDArray[Any]:
        """Return the action (m,) for an observation (n,)."""
        ...


def cube_interface(settings: PolicySettings, shown_action: ShownAction) -> Interface:
    """Return the interface of policies of the cube task."""
    shown = {ShownAction.LAST: Field.LAST_ACTION, ShownAction.BEFORE_LAST: Field.ACTION_BEFORE_LAST}[shown_action]
    return Interface(
        (Observed(Field.LENGTHS, OBSERVATION_ORDER), Observed(shown)),
        Action(settings.nominal, settings.scale),
        settings.control_rate_hz,
        settings.torque_limit,
    )


def _check_names(where: str, table: object, known: set[str]) -> None:
    if not isinstance(table, dict):
        raise ValueError(f"{where} is a table, got {table!r}")
    if unknown := sorted(set(table) - known):
        raise ValueError(f"{where}: unknown {', '.join(map(repr, unknown))}; choose from {', '.join(sorted(known))}")


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
        raise ValueError(f"unknown field {name!r}; choose from {', '.join(names)}")
    return names[name]


def _channels(row: Mapping[str, Any]) -> tuple[Channel, ...]:
    by_label = {channel.label: channel for channel in Channel}
    labels = row.get("channels", list(by_label))
    if unknown := [label for label in labels if label not in by_label]:
        raise ValueError(f"unknown channel {unknown[0]!r}; choose from {', '.join(by_label)}")
    if not labels or len(set(labels)) != len(labels):
        raise ValueError(f"channels must be named once each, got {labels}")
    return tuple(by_label[label] for label in labels)
