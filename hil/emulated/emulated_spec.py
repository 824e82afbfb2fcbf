"""Specification of an emulated hand, and of any hand by the value of `--hil`."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from aero_hil_toml import meant
from hil.targets.hand_spec import PortSpec
from hil.targets.hands_file import EMULATED_TARGETS, fields_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hil.emulated.faults.fault import Injection
    from model.units.conditions import Conditions
    from simulator.scene import Cube


@dataclass(frozen=True)
class EmulatedSpec(PortSpec):
    """Specification of an emulated hand.

    Raises:
        ValueError: as for `PortSpec`; faults that cannot be combined; on `pty`, host faults, a cube or conditions.
    """

    in_software: ClassVar[bool] = True

    port: str = "emulated"
    """`emulated` (this process, virtual time) or `pty` (own process, real time)."""
    guarded: bool = False
    unit: str = "reference"
    """Shipped name, `plausible:SEED` or `.toml` path."""
    seed: int = 0
    """Seed of noise and random faults."""
    homed: bool = False
    """True to home the hand `HOMINGS` times at opening; otherwise its zeros are ideal."""
    faults: tuple[Injection, ...] = ()
    """Faults, given as objects or as texts that `parse_fault` reads."""
    firmware_program: Path | None = None
    """Program from `aero-hil firmware build` for the board, built from version `firmware`."""
    cube: Cube | None = None
    """Cube in the hand, whose mechanics are then a `model.cube_plant.CubePlant`."""
    conditions: Conditions | None = None
    """Initial conditions (pose, temperature, host jitter); None takes the unit's."""

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "faults", parsed_faults(self.faults))
        if self.firmware_program is not None:
            object.__setattr__(self, "firmware_program", Path(self.firmware_program))
        if self.faults:
            self._check_faults()
        if self.port != "emulated" and (self.cube is not None or self.conditions is not None):
            raise ValueError(f"a cube and conditions are of a hand in this process, `emulated`, not of {self.port}")

    def _check_faults(self) -> None:
        # Imported here, because help texts need no faults and should load fast.
        from hil.emulated.faults.host import refuse_at_a_port  # noqa: PLC0415
        from hil.emulated.faults.schedule import refuse_rivals  # noqa: PLC0415

        refuse_rivals(self.faults)
        if self.port == "pty":
            refuse_at_a_port(self.faults)


def parsed_faults(faults: Iterable[Injection | str]) -> tuple[Injection, ...]:
    """Return faults as objects.

    Raises:
        ValueError: an unknown fault, or one text in place of a list.
    """
    if isinstance(faults, str):
        raise ValueError(f"faults are a list, such as [{faults!r}], not the text {faults!r}")
    given = tuple(faults)
    if not given:
        return ()
    from hil.emulated.faults.catalogue import parse_fault  # noqa: PLC0415 - help is quick

    return tuple(parse_fault(one) if isinstance(one, str) else one for one in given)


OF_EMULATED = {field.name for field in fields(EmulatedSpec)} - {field.name for field in fields(PortSpec)}
"""Fields of an emulated hand only."""
REFUSED = {
    "faults": "faults are injected into an emulated hand, not into {port!r}; see `aero-hil proxy` for its link",
    "firmware_program": "a firmware program runs on an emulated hand, not on {port!r}; give `emulated` or `pty`",
    "cube": "a cube is in a hand in this process, `emulated`, not on {port!r}",
    "conditions": "conditions are of a hand in this process, `emulated`, not of {port!r}",
}
"""Fields that a hand on a port refuses; the other fields of an emulated hand do not concern it."""


def named_spec(name: str = "emulated", **asked: Any) -> PortSpec:
    """Return the specification of the hand that `--hil` names, see `hil.targets.hands_file`.

    Args:
        name: `emulated`, `pty`, the path or pyserial URL of a port, or a name in `hands.toml`.
        asked: fields of `EmulatedSpec` or, on a port, of `PortSpec`; None takes the value of `hands.toml`, by default
            the field's. On a port, unit, seed and homing are ignored.

    Raises:
        ValueError: an unknown name, an error in `hands.toml`, or fields that the specification refuses.
    """
    said = fields_of(name)
    kind = EmulatedSpec if said["port"] in EMULATED_TARGETS else PortSpec
    return with_fields(kind(**said), **asked)


def with_fields(spec: PortSpec, **asked: Any) -> PortSpec:
    """Return a specification with fields replaced, None and fields of other hands left out.

    Raises:
        ValueError: an unknown field, or one that this hand refuses.
    """
    known = {field.name for field in fields(EmulatedSpec)}
    given = {name: value for name, value in asked.items() if value is not None}
    for name, value in given.items():
        if name not in known:
            raise ValueError(f"a hand has no {name!r}; {meant(name, known)}it has {', '.join(sorted(known))}")
        if not spec.in_software and name in REFUSED and value not in ((), []):
            raise ValueError(REFUSED[name].format(port=spec.port))
    left_out = set() if spec.in_software else OF_EMULATED
    return replace(spec, **{name: value for name, value in given.items() if name not in left_out})
