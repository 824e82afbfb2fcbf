"""Units: one TOML file for each individual hand behind the emulated electronics.

`like` names a shipped unit whose keys a file inherits. `[hand]` fills `model.BuiltHandParameters`, `[servos]` fills
`firmware_emulator.ServoParameters`; missing keys keep their defaults. The motors' back-EMF follows from the servos.
`description` identifies the hand.
"""

import dataclasses
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from aero.regular_file import read_text
from aero_hil_toml import filled, parsed
from firmware_emulator.plant import Drive
from firmware_emulator.servo.parameters import ServoParameters
from model import BuiltHandParameters


@dataclass(frozen=True)
class Unit:
    """Parameters of one individual hand."""

    name: str = ""
    """Name of the shipped file, or path of the user's."""
    description: str = ""
    """Identity of the hand and source of its numbers."""
    unfinished: bool = False
    """True for the intermediate result of an aborted fit."""
    hand: BuiltHandParameters = field(default_factory=BuiltHandParameters)
    """Mechanics behind the servos' shafts; its back-EMF is replaced by the servos'."""
    servos: ServoParameters = field(default_factory=ServoParameters)
    """Parameters of all seven servos, which are equal."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "hand", dataclasses.replace(self.hand, back_emf=self.servos.back_emf))

    def position_drive(self, share: float = 1.0) -> Drive:
        """Return a servo's drive in position mode with setpoint zero.

        Args:
            share: current limit, fraction of the stall torque; the free speed does not depend on it.
        """
        stall = self.servos.stall_torque
        return Drive(
            stiffness=self.servos.stiffness, damping=self.servos.damping, limit=stall, current_limit=share * stall
        )


UNFINISHED = "unfinished:"
"""Prefix of a unit path that accepts the result of an aborted fit."""


def shipped_units() -> tuple[str, ...]:
    """Return the names of the shipped units."""
    files = (entry.name for entry in resources.files(__name__).iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml")))


def _shipped(name: str) -> str:
    """Return the text of a shipped unit's file."""
    if name not in shipped_units():
        raise ValueError(f"unknown unit {name!r}; choose from {', '.join(shipped_units())}")
    return resources.files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8")


def _merged(base: dict[str, Any], table: dict[str, Any]) -> dict[str, Any]:
    """Return `base` with the keys of `table`, section by section."""
    sections = {key: base[key] | value for key, value in table.items() if isinstance(value, dict) and key in base}
    return base | table | sections


def load_unit(name: str) -> Unit:
    """Return a unit by shipped name, or by path (any name with the suffix `.toml`).

    Raises:
        ValueError: unknown unit; invalid file, with the key in the message; or an unfinished fit without the prefix
            `unfinished:`.
    """
    whole_name, name = name, name.removeprefix(UNFINISHED)
    if name in shipped_units():
        text = _shipped(name)
    elif name.endswith(".toml"):
        try:
            text = read_text(Path(name))
        except (OSError, UnicodeDecodeError) as error:
            raise ValueError(f"cannot read the unit file {name}: {error}") from error
        if not text.strip():
            raise ValueError(f"the unit file {name} is empty")
    else:
        raise ValueError(f"unknown unit {name!r}; choose from {', '.join(shipped_units())}, or give a .toml file")
    table = parsed(text, f"unit {name}")
    if like := table.pop("like", ""):
        table = _merged(parsed(_shipped(str(like)), f"unit {like}"), table)
    if "name" in table:
        raise ValueError(f"unit {name}: a unit is named by its file, remove the key 'name'")
    unit = filled(Unit, table, f"unit {name}")
    if "back_emf" in table.get("hand", {}):
        raise ValueError(
            f"unit {name}: hand.back_emf follows from servos.stall_torque and no_load_speed_counts, remove it"
        )
    if unit.unfinished and name == whole_name:
        raise ValueError(
            f"unit {name} is an unfinished fit. Continue with `aero-hil calibrate --start`, or use it anyway as "
            f"{UNFINISHED}{name}"
        )
    return dataclasses.replace(unit, name=whole_name)
