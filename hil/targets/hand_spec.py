"""Which hand, where and how: one object, whether options, `hands.toml`, pytest or Python say it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, get_args

from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from hil.targets.hands_file import IN_SOFTWARE, fields_of

if TYPE_CHECKING:
    from aero.safety import Thresholds
    from hil.faults.fault import Injection
    from model.scene import Cube
    from model.units.conditions import Conditions

Side = Literal["right", "left"]
PHYSICAL = "physical"
"""Unit name of a physical hand."""

HOMINGS = 2
"""Homings before a validation. From its resting pose a thumb finds another zero than from the pose that homing leaves:
of 20 healthy emulated hands 5 failed after one homing, 1 after two, none after three."""


def hand_words(
    side: str, target: str, firmware: str, *, unit: str, seed: int, hand_id: str = "", wrong: str = ""
) -> str:
    """Return which hand it is, in the words of every page, table and header."""
    individual = f" {hand_id}" if hand_id else ""
    which = "" if unit == PHYSICAL else f", unit {unit}, seed {seed}"
    return f"{side} hand{individual} on {target}, firmware {firmware}{which}{f', with {wrong}' if wrong else ''}"


@dataclass(frozen=True)
class HandSpec:
    """A hand that can be opened by `hil.open_target`.

    Raises:
        ValueError: an unknown firmware or side; a firmware program or faults for a physical hand; faults that cannot be
            combined; a cube or conditions for another hand than an `emulated` one.
    """

    target: str = "emulated"
    """`emulated` (this process, virtual time), `pty` (own process, real time), or the path or URL of a port."""
    firmware: str = DEFAULT_FIRMWARE
    """Version that is emulated, or that the physical hand runs; no board can report its own."""
    side: Side = "right"
    unit: str = "reference"
    """Shipped name, `plausible:SEED` or `.toml` path of an emulated hand; a physical hand has none."""
    seed: int = 0
    """Of an emulated hand's noise, and of the chances of its faults."""
    guarded: bool | None = None
    """Whether the hand is guarded; a physical one is unless this is False."""
    thresholds: Thresholds | None = None
    """When a guarded hand is stopped, also of `hands.toml`; the defaults when None."""
    hand_id: str = ""
    """Name of the individual hand, for its recordings; the serial number of its USB port when empty."""
    firmware_program: Path | None = None
    """What `aero-hil firmware build` made, on the board of an emulated hand; `firmware` says what it was made from."""
    homed: bool = False
    """Whether an emulated hand homes when it is opened, `HOMINGS` times; else its zeros are ideal."""
    faults: tuple[Injection, ...] = ()
    """What is wrong with an emulated hand, see `hil.faults`."""
    cube: Cube | None = None
    """Lies ready beside an `emulated` hand, whose ground truth is then a `model.cube_plant.CubePlant`."""
    conditions: Conditions | None = None
    """How an `emulated` hand is found, none of which is a fault; as its unit says when None."""
    twin: str | None = None
    """Unit of this physical hand, of `hands.toml`."""
    baseline: Path | None = None
    """Folder of its earlier figures, of `hands.toml`."""

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
        # Whoever has faults has loaded what they act on; help has not.
        from hil.faults.host import refuse_at_a_port  # noqa: PLC0415
        from hil.faults.schedule import Schedule  # noqa: PLC0415

        Schedule(self.faults, self.seed)
        if not self.in_software:
            raise ValueError(
                f"faults are injected into an emulated hand, not into {self.target!r}; "
                "see `aero-hil proxy` for its link"
            )
        if self.target == "pty":
            refuse_at_a_port(self.faults)

    @classmethod
    def named(cls, target: str = "emulated", *, hand: Side | None = None, **fields: Any) -> Self:
        """Return the hand of a target or of a name in `hands.toml`, see `hil.targets.hands_file`.

        Args:
            target: `emulated`, `pty`, the path or pyserial URL of a port, or a name.
            hand: side; that of `hands.toml` when None, else right.
            fields: the other fields; None for what `hands.toml` says, else the default.

        Raises:
            ValueError: an unknown name, a mistake in `hands.toml`, or what `HandSpec` refuses.
        """
        said = {"side": hand, **fields}
        return cls(**(fields_of(target) | {name: value for name, value in said.items() if value is not None}))

    @property
    def in_software(self) -> bool:
        """Whether it is an emulated hand."""
        return self.target in IN_SOFTWARE

    @property
    def guard(self) -> Thresholds | None:
        """When its guard stops it; None for an unguarded hand."""
        from aero.safety import Thresholds  # noqa: PLC0415 - help is quick

        guarded = not self.in_software if self.guarded is None else self.guarded
        return (self.thresholds or Thresholds()) if guarded else None

    def describe(self) -> str:
        """Return which hand it is, for people."""
        unit = self.unit if self.in_software else PHYSICAL
        wrong = ", ".join(map(str, self.faults))
        return hand_words(
            self.side, self.target, self.firmware, unit=unit, seed=self.seed, hand_id=self.hand_id, wrong=wrong
        )

    def argv(self) -> list[str]:
        """Return the options that give `aero-hil emulate` this hand; `hil.cli.options` reads them back."""
        words = ["--firmware", self.firmware, "--hand", self.side, "--unit", self.unit, "--seed", str(self.seed)]
        if self.firmware_program is not None:
            words += ["--firmware-program", str(self.firmware_program)]
        for fault in self.faults:
            words += ["--fault", str(fault)]
        return words + ["--homed"] * self.homed
