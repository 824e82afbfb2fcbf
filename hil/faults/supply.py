"""A supply that sags: all motors lose torque while they draw much, and the board may lose more than that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.plant import Drive, Plant
from hil.faults.assembly import Begin, HandAssembly, Injector
from hil.faults.fault import Fault, Kind
from hil.faults.motor import weaker
from hil.faults.shaft_fault import ShaftFault

NOTICEABLE = 0.01
"""Change of the voltage, fraction, from which on the drives are updated."""
SHAFTS = range(7)


class Sagging(ShaftFault):
    """A supply with a resistance in front of all motors."""

    def __init__(self, behind: Plant, lost_at_stall: float, stall_torque: float) -> None:
        super().__init__(behind, shaft=0)
        self._lost_per_effort = lost_at_stall / (len(SHAFTS) * stall_torque)
        self._lost = 0.0
        self._on_change: Callable[[float], None] = lambda _lost: None
        self._all_asked = [Drive(powered=False) for _ in SHAFTS]

    def follow(self, on_change: Callable[[float], None]) -> None:
        """Call this with the fraction of the voltage that is lost, whenever it has changed noticeably."""
        self._on_change = on_change

    def advance_to(self, t: float) -> None:
        """Integrate to `t`, s, and see what the motors draw."""
        super().advance_to(t)
        lost = self._lost_per_effort * float(abs(self.behind.efforts()).sum()) if self.active else 0.0
        if abs(lost - self._lost) > NOTICEABLE:
            self._lost = lost
            self._on_change(lost)
            self.renew()

    def drive(self, shaft: int, drive: Drive) -> None:
        """Replace the drive of a shaft."""
        self._all_asked[shaft] = drive
        self.behind.drive(shaft, weaker(drive, self._lost))

    def set_setpoint(self, shaft: int, setpoint: float) -> None:
        """Change the goal angle of a shaft, rad."""
        self._all_asked[shaft] = replace(self._all_asked[shaft], setpoint=setpoint)
        self.behind.set_setpoint(shaft, setpoint)

    def renew(self) -> None:
        """Drive all motors with the present voltage."""
        for shaft in SHAFTS:
            self.drive(shaft, self._all_asked[shaft])


class Supply:
    """What a sagging supply does to the electronics: the servos measure it, and the board may not outlive it."""

    def __init__(self, hand: EmulatedHand, volts: float, *, feeds_board: bool) -> None:
        """Follow a supply of so many volts without load."""
        self._hand = hand
        self._volts = volts
        self._feeds_board = feeds_board
        self._browned_out = False

    def changed(self, lost: float) -> None:
        """Take the fraction of the voltage that is lost now."""
        volts = self._volts * (1.0 - lost)
        self._hand.supply(volts)
        if not self._feeds_board:
            return
        if not self._browned_out and volts < BROWN_OUT_V:
            self._browned_out = True
            # Not from inside a step of the plant.
            self._hand.kernel.call_at(self._hand.kernel.now, self._hand.reset, "brown_out")
        elif volts > RECOVERED_V:
            self._browned_out = False


BROWN_OUT_V, RECOVERED_V = 3.6, 4.0
"""Below the first, the board's regulator cannot give the chip its 3.3 V (assumption); above the second it is well."""
BROWNS_OUT = "supply_browns_out"
KINDS = (
    Kind(
        "supply_sags",
        "hand",
        ("D13", "D11"),
        "of voltage lost when all motors stall",
        (0.3, 0.6, 0.9),
        "the supply is weak under load",
        bounds=(0, 0.95),
    ),
    Kind(
        BROWNS_OUT,
        "hand",
        ("D13", "B1"),
        "of voltage lost when all motors stall",
        (0.6, 0.75, 0.9),
        "the supply is weak under load and feeds the board too, which restarts",
        bounds=(0, 0.95),
    ),
)


def _sagging(assembly: HandAssembly, fault: Fault) -> Begin:
    sagging = Sagging(assembly.shafts, fault.severity, assembly.healthy.servos.stall_torque)
    assembly.on_connect(
        lambda hand: sagging.follow(
            Supply(hand, assembly.unit.servos.voltage, feeds_board=fault.name == BROWNS_OUT).changed
        )
    )
    return assembly.insert(sagging)


INJECTORS: dict[str, Injector] = dict.fromkeys(("supply_sags", BROWNS_OUT), _sagging)
