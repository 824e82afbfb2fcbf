"""Opening of an emulated hand, in this process or on a pseudo-terminal, and of any hand by the value of `--hil`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from aero.clock import Clock
from aero.firmware import DEFAULT_FIRMWARE, firmware_of
from aero.hand import Hand
from aero.safety import Thresholds
from aero.side import Side
from aero.transport import Transport
from firmware_emulator.native.program import FirmwareProgramError
from hil.emulated.emulated_hand import build_emulated, host_link, with_initial_conditions
from hil.emulated.emulated_spec import EmulatedSpec, named_spec, parsed_faults, with_fields
from hil.emulated.emulated_target import EmulatedTarget, GroundTruth
from hil.emulated.faults.bench import BenchHere
from hil.emulated.faults.fault import Injection
from hil.emulated.faults.workbench import Workbench
from hil.emulated.pty_process import serve_in_child
from hil.targets.argument_names import suggesting
from hil.targets.hand_spec import HOMINGS, PortSpec
from hil.targets.opening import Opening, drive, driven, open_spec
from hil.targets.wire_log import WireLog
from model.units import Unit
from model.units.conditions import Conditions
from model.units.plausible import unit_named
from simulator.scene import Cube


@suggesting
def emulate(
    *,
    unit: str = "reference",
    side: Side = "right",
    firmware: str = DEFAULT_FIRMWARE,
    faults: Iterable[Injection | str] = (),
    seed: int = 0,
    real_time: bool = False,
    homed: bool = False,
    guarded: bool = False,
    thresholds: Thresholds | None = None,
    cube: Cube | None = None,
    conditions: Conditions | None = None,
    firmware_program: Path | None = None,
) -> AbstractContextManager[EmulatedTarget]:
    """Return a context manager that opens an emulated hand.

    Args:
        unit: shipped name, `plausible:SEED` or `.toml` path.
        side: `right` or `left`.
        firmware: version on the board.
        faults: faults as objects or texts, such as `motor_dead:ring`.
        seed: seed of noise and random faults.
        real_time: True for a hand on a pseudo-terminal in its own process, False for one in this process, on virtual
            time.
        homed: True to home the hand first; otherwise its zeros are ideal.
        guarded: True to drive the hand with the guard of a physical one.
        thresholds: thresholds of the guard; None takes the defaults.
        cube: cube in a hand in this process.
        conditions: initial conditions of a hand in this process; None takes the unit's.
        firmware_program: program from `aero-hil firmware build` for the board.

    Raises:
        ValueError: an unknown unit, side, firmware or fault, or fields that cannot be combined.
        FaultNeverFiredError: a fault had no effect; raised at the end of a context without another error.
        FirmwareProgramError: the firmware program does not run; raised at the start of the context.
    """
    port = "pty" if real_time else "emulated"
    return open_emulated(
        EmulatedSpec(
            port, firmware, side, guarded, thresholds, unit=unit, seed=seed, homed=homed, faults=parsed_faults(faults),
            firmware_program=firmware_program, cube=cube, conditions=conditions,
        )
    )  # fmt: skip


def open_target(target: PortSpec | str = "emulated", **fields: Any) -> AbstractContextManager[Any]:
    """Return a context manager that opens the hand that `--hil` names.

    Args:
        target: specification of the hand, or its value of `--hil`.
        fields: fields of `EmulatedSpec`, as `named_spec` and `with_fields` take them.

    Raises:
        ValueError: as for `named_spec`, and as `emulate` and `hil.open_port`.
    """
    return open_any(named_spec(target, **fields) if isinstance(target, str) else with_fields(target, **fields))


def open_any(spec: PortSpec) -> AbstractContextManager[Any]:
    """Return a context manager that opens the hand of a specification; see `emulate` and `hil.open_port`."""
    return open_emulated(spec) if isinstance(spec, EmulatedSpec) else open_spec(spec)


def open_emulated(spec: EmulatedSpec) -> AbstractContextManager[EmulatedTarget]:
    """Return a context manager that opens the emulated hand of a specification; see `emulate`."""
    unit = unit_named(spec.unit)
    if spec.conditions is not None:
        unit = spec.conditions.applied(unit)
    return (_pty if spec.port == "pty" else _emulated)(EmulatedOpening(spec, unit=unit))


@dataclass(frozen=True)
class EmulatedOpening(Opening):
    """Parameters of the opening of an emulated hand."""

    spec: EmulatedSpec
    unit: Unit = field(kw_only=True)
    """Unit of the hand, adapted to its initial conditions."""

    def fields(self, hand: Hand, clock: Clock, wire: WireLog) -> dict[str, Any]:
        """Return the fields of `EmulatedTarget` that every emulated hand has."""
        mine = {"unit": self.unit.name, "seed": self.spec.seed, "program_errors": (FirmwareProgramError,)}
        return super().fields(hand, clock, wire) | mine


@contextmanager
def _emulated(opening: EmulatedOpening) -> Iterator[EmulatedTarget]:
    electronics, workbench = build_emulated(opening.unit, opening.spec)
    with closing(electronics), in_process(opening, workbench, host_link(workbench)) as target:
        yield target
    workbench.schedule.require_all_fired()


@contextmanager
def in_process(opening: EmulatedOpening, workbench: Workbench, link: Transport) -> Iterator[EmulatedTarget]:
    """Yield the target of an emulated hand in this process, reached by `link`."""
    spec, electronics = opening.spec, workbench.electronics
    clock = electronics.clock
    settable = firmware_of(spec.firmware).settings is not None
    found = with_initial_conditions(spec.conditions or Conditions(), link, clock, settable=settable, seed=spec.seed)
    wire = WireLog(found, clock)
    with drive(wire, clock, opening) as hand:
        for _ in range(HOMINGS if spec.homed else 0):
            hand.home()
        yield EmulatedTarget(
            **opening.fields(hand, clock, wire),
            bench=BenchHere(workbench),
            in_process=GroundTruth(workbench.mechanics, electronics),
        )


@contextmanager
def _pty(opening: EmulatedOpening) -> Iterator[EmulatedTarget]:
    with serve_in_child(opening.spec, opening.delays) as (path, bench), driven(opening, path) as (hand, clock, wire):
        yield EmulatedTarget(**opening.fields(hand, clock, wire), bench=bench)
