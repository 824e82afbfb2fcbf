"""Supply faults: low voltage, and voltage that sags under load down to a brown-out of the board."""

from dataclasses import replace

from firmware_emulator.plant import Drive
from hil.emulated.faults.assembly import HandAssembly
from hil.emulated.faults.fault import Fault, FaultLayer, Inject, Injection, Severity
from hil.emulated.faults.mechanics import another_unit
from hil.emulated.faults.motor import on_shaft, weaker
from hil.emulated.faults.shaft_fault import ShaftFault
from hil.verdict.part import Part
from model.units import Unit

SUPPLY = FaultLayer.SUPPLY
NOTICEABLE = 0.01
"""Threshold of voltage change, fraction; above it the drives are updated."""
BROWN_OUT_V, RECOVERED_V = 3.6, 4.0
"""Thresholds of the board's supply, V: below the first it browns out, above the second it has recovered.
Source: assumption (dropout of the 3.3 V regulator)."""
SHAFTS = range(7)


class Sagging(ShaftFault):
    """A supply with a resistance in front of all motors."""

    def __init__(self, assembly: HandAssembly, lost_at_stall: float, *, feeds_board: bool) -> None:
        super().__init__(assembly.shafts, shaft=0)
        self._assembly, self._feeds_board = assembly, feeds_board
        self._lost_per_effort = lost_at_stall / (len(SHAFTS) * assembly.healthy.servos.stall_torque)
        self._lost = 0.0
        self._browned_out = False
        self._all_asked = [Drive(powered=False) for _ in SHAFTS]

    def advance_to(self, t: float) -> None:
        """Integrate to `t`, s, and update the sag from the load."""
        super().advance_to(t)
        lost = self._lost_per_effort * float(abs(self.behind.efforts()).sum()) if self.active else 0.0
        if abs(lost - self._lost) > NOTICEABLE:
            self._lost = lost
            self._supply()
            self.renew()

    def end(self) -> None:
        """Clear the sag."""
        super().end()
        self._lost = 0.0
        self._supply()

    @property
    def supply_left(self) -> float:
        """Supply voltage under the present load, as a fraction of the voltage without load."""
        return 1.0 - self._lost

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of a shaft."""
        self._all_asked[shaft] = drive
        self.behind.drive(shaft, weaker(drive, self._lost))

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change the goal angle of a shaft, rad."""
        self._all_asked[shaft] = replace(self._all_asked[shaft], setpoint=setpoint)
        self.behind.set_setpoint(shaft, setpoint)

    def renew(self) -> None:
        """Apply the present voltage to all motors."""
        for shaft in SHAFTS:
            self.drive(shaft, self._all_asked[shaft])

    def _supply(self) -> None:
        """Apply the sagged supply voltage to the servos; brown the board out below its minimum."""
        if not self._assembly.is_running:
            return
        electronics = self._assembly.electronics
        volts = self._assembly.unit.servos.voltage * self.supply_left
        electronics.supply(volts)
        if self._feeds_board and not self._browned_out and volts < BROWN_OUT_V:
            self._browned_out = True
            # Deferred, because a reset inside a step of the plant would change the drives under integration.
            electronics.kernel.call_at(electronics.kernel.now, electronics.reset, "brown_out")
        elif volts > RECOVERED_V:
            self._browned_out = False


def _sags(*, feeds_board: bool) -> Inject:
    return on_shaft(lambda assembly, fault: Sagging(assembly, fault.severity, feeds_board=feeds_board))


def _low(unit: Unit, fault: Injection) -> Unit:
    return replace(unit, hand=replace(unit.hand, supply_ratio=unit.hand.supply_ratio * (1.0 - fault.severity)))


AT_STALL = "of voltage lost when all motors stall"
# fmt: off
FAULTS = (
    Fault("supply_low", SUPPLY, Part.SUPPLY, "the supply is weak",
          another_unit(_low), severity=Severity("of voltage lost", (0.08, 0.2, 0.4), 0, 0.95)),
    Fault("supply_sags", SUPPLY, Part.SUPPLY, "the supply is weak under load",
          _sags(feeds_board=False), severity=Severity(AT_STALL, (0.3, 0.6, 0.9), 0, 0.95)),
    Fault("supply_browns_out", SUPPLY, Part.SUPPLY,
          "the supply is weak under load and feeds the board too, which restarts",
          _sags(feeds_board=True), severity=Severity(AT_STALL, (0.6, 0.75, 0.9), 0, 0.95)),
)
# fmt: on
