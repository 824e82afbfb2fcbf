"""Specification of a hand on a port, shared by the command line, `hands.toml`, pytest and Python."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, get_args

from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.side import Side
from hil.targets.hands_file import EMULATED_TARGETS, fields_of

if TYPE_CHECKING:
    from aero.safety import Thresholds

PHYSICAL = "physical"

HOMINGS = 2
"""Homings before a validation. A thumb's zero differs between homing from rest and from the pose after a homing:
of 20 healthy emulated hands 5 failed after one homing, 1 after two, none after three."""


def hand_words(side: str, port: str, firmware: str, *, unit: str, seed: int, hand_id: str = "", wrong: str = "") -> str:
    """Return the description of a hand that every page, table and header shows."""
    individual = f" {hand_id}" if hand_id else ""
    which = "" if unit == PHYSICAL else f", unit {unit}, seed {seed}"
    return f"{side} hand{individual} on {port}, firmware {firmware}{which}{f', with {wrong}' if wrong else ''}"


@dataclass(frozen=True)
class PortSpec:
    """Specification of a hand on a port.

    Raises:
        ValueError: an unknown firmware or side.
    """

    in_software: ClassVar[bool] = False
    """True for an emulated hand."""

    port: str
    """Path or pyserial URL of the port."""
    firmware: str = DEFAULT_FIRMWARE
    """Declared firmware version; a board cannot report its own."""
    side: Side = "right"
    guarded: bool = True
    thresholds: Thresholds | None = None
    """Thresholds of the guard; None takes the defaults."""
    hand_id: str = ""
    """Name of the individual hand in recordings; if empty, the serial number of its USB port."""
    may_be_silent: bool = False
    """True to open a hand even if it does not answer; the first experiment then ends with the error."""
    twin: str | None = None
    """Unit that models this hand, from `hands.toml`."""
    baseline: Path | None = None
    """Folder with earlier results of this hand, from `hands.toml`."""

    def __post_init__(self) -> None:
        firmware_of(self.firmware)
        if self.side not in get_args(Side):
            raise ValueError(f"a hand's side is right or left, not {self.side!r}")

    @property
    def unit(self) -> str:
        """Unit of the hand."""
        return PHYSICAL

    @property
    def seed(self) -> int:
        """Seed of an emulated hand."""
        return 0

    @property
    def faults(self) -> tuple[Any, ...]:
        """Faults of an emulated hand."""
        return ()

    @property
    def guard(self) -> Thresholds | None:
        """Guard thresholds, or None if the hand is unguarded."""
        from aero.safety import Thresholds  # noqa: PLC0415 - help is quick

        return (self.thresholds or Thresholds()) if self.guarded else None

    def describe(self) -> str:
        """Return a description of the hand for display."""
        wrong = ", ".join(map(str, self.faults))
        return hand_words(
            self.side, self.port, self.firmware, unit=self.unit, seed=self.seed, hand_id=self.hand_id, wrong=wrong
        )


def named_port(name: str, **asked: Any) -> PortSpec:
    """Return the specification of the hand on a port, or of a name in `hands.toml`.

    Args:
        name: path or pyserial URL of the port, or a name.
        asked: fields of `PortSpec`; None takes the value of `hands.toml`, by default the field's.

    Raises:
        ValueError: an unknown name, an error in `hands.toml`, fields that `PortSpec` refuses, or an emulated hand.
    """
    said = fields_of(name)
    if said["port"] in EMULATED_TARGETS:
        raise ValueError(
            f"{name!r} is an emulated hand; `hil.emulate()` makes one, and `aero-hil emulate --link PATH` serves one"
        )
    return replace(PortSpec(**said), **{field: value for field, value in asked.items() if value is not None})
