"""Specification of a hand to open, shared by the command line, `hands.toml`, pytest and Python."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, get_args

from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.former_names import renamed
from aero.side import Side
from hil.targets.hands_file import EMULATED_TARGETS, fields_of

if TYPE_CHECKING:
    from aero.safety import Thresholds
    from hil.emulated.faults.fault import Injection
    from model.scene import Cube
    from model.units.conditions import Conditions

PHYSICAL = "physical"

HOMINGS = 2
"""Homings before a validation. A thumb's zero differs between homing from rest and from the pose after a homing:
of 20 healthy emulated hands 5 failed after one homing, 1 after two, none after three."""


def hand_words(
    side: str, target: str, firmware: str, *, unit: str, seed: int, hand_id: str = "", wrong: str = ""
) -> str:
    """Return the description of a hand that every page, table and header shows."""
    individual = f" {hand_id}" if hand_id else ""
    which = "" if unit == PHYSICAL else f", unit {unit}, seed {seed}"
    return f"{side} hand{individual} on {target}, firmware {firmware}{which}{f', with {wrong}' if wrong else ''}"


@dataclass(frozen=True)
class HandSpec:
    """Specification of a hand for `hil.open_target`.

    Raises:
        ValueError: an unknown firmware or side; a firmware program or faults for a physical hand; faults that cannot be
            combined; a cube or conditions for a target other than `emulated`.
    """

    target: str = "emulated"
    """`emulated` (this process, virtual time), `pty` (own process, real time), or the path or URL of a port."""
    firmware: str = DEFAULT_FIRMWARE
    """Firmware version, emulated or declared for a physical hand, whose board cannot report it."""
    side: Side = "right"
    unit: str = "reference"
    """Unit of an emulated hand: shipped name, `plausible:SEED` or `.toml` path; unused for a physical hand."""
    seed: int = 0
    """Seed of an emulated hand's noise and random faults."""
    guarded: bool | None = None
    """True for a guarded hand; None guards physical hands only."""
    thresholds: Thresholds | None = None
    """Thresholds of the guard; None takes the defaults."""
    hand_id: str = ""
    """Name of the individual hand in recordings; if empty, the serial number of its USB port."""
    firmware_program: Path | None = None
    """Program from `aero-hil firmware build` for an emulated board, built from version `firmware`."""
    homed: bool = False
    """True to home an emulated hand `HOMINGS` times at opening; otherwise its zeros are ideal."""
    may_be_silent: bool = False
    """True to open a hand on a port even if it does not answer; the first experiment then ends with the error."""
    faults: tuple[Injection, ...] = ()
    cube: Cube | None = None
    """Cube of an `emulated` hand, whose ground truth is then a `model.cube_plant.CubePlant`."""
    conditions: Conditions | None = None
    """Initial conditions of an `emulated` hand (pose, temperature, host jitter); None takes the unit's."""
    twin: str | None = None
    """Unit that models this physical hand, from `hands.toml`."""
    baseline: Path | None = None
    """Folder with earlier results of this hand, from `hands.toml`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "faults", tuple(self.faults))
        if self.firmware_program is not None:
            object.__setattr__(self, "firmware_program", Path(self.firmware_program))
        firmware_of(self.firmware)
        if self.side not in get_args(Side):
            raise ValueError(f"a hand is right or left, not {self.side!r}")
        if self.firmware_program is not None and not self.in_software:
            raise ValueError(
                f"a firmware program runs on an emulated hand, not on {self.target!r}; give `emulated` or `pty`"
            )
        if self.faults:
            self._check_faults()
        if self.target != "emulated" and (self.cube is not None or self.conditions is not None):
            raise ValueError(f"a cube and conditions are of a hand in this process, `emulated`, not of {self.target}")

    def _check_faults(self) -> None:
        # Imported here, because help texts need no faults and should load fast.
        from hil.emulated.faults.host import refuse_at_a_port  # noqa: PLC0415
        from hil.emulated.faults.schedule import Schedule  # noqa: PLC0415

        Schedule(self.faults, self.seed)
        if not self.in_software:
            raise ValueError(
                f"faults are injected into an emulated hand, not into {self.target!r}; "
                "see `aero-hil proxy` for its link"
            )
        if self.target == "pty":
            refuse_at_a_port(self.faults)

    @classmethod
    @renamed(hand="side")
    def named(cls, target: str = "emulated", *, side: Side | None = None, **fields: Any) -> Self:
        """Return the specification for a target or for a name in `hands.toml`, see `hil.targets.hands_file`.

        Args:
            target: `emulated`, `pty`, the path or pyserial URL of a port, or a name.
            side: `right` or `left`; None takes that of `hands.toml`, by default right.
            fields: other fields; None takes the value of `hands.toml`, by default the field's.

        Raises:
            ValueError: an unknown name, an error in `hands.toml`, or fields that `HandSpec` refuses.
        """
        said = {"side": side, **fields}
        return cls(**(fields_of(target) | {name: value for name, value in said.items() if value is not None}))

    @property
    def in_software(self) -> bool:
        """True for an emulated hand."""
        return self.target in EMULATED_TARGETS

    @property
    def guard(self) -> Thresholds | None:
        """Guard thresholds, or None if the hand is unguarded."""
        from aero.safety import Thresholds  # noqa: PLC0415 - help is quick

        guarded = not self.in_software if self.guarded is None else self.guarded
        return (self.thresholds or Thresholds()) if guarded else None

    def describe(self) -> str:
        """Return a description of the hand for display."""
        unit = self.unit if self.in_software else PHYSICAL
        wrong = ", ".join(map(str, self.faults))
        return hand_words(
            self.side, self.target, self.firmware, unit=unit, seed=self.seed, hand_id=self.hand_id, wrong=wrong
        )
