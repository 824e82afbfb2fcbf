"""Means of faults outside the catalogue: faults that look at the hand, wires, passages of bytes."""

from dataclasses import replace

from aero.channels import CABLES, Channel
from firmware_emulator.firmware.frames import FRAME, FRAME_SIZE, Opcode
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.bus import SpoiledAnswers
from hil.emulated.faults.fault import FaultLayer
from hil.emulated.faults.link import LinkFault
from hil.emulated.faults.link_faults import LinkEffect
from hil.emulated.faults.mechanics import JOINTS
from hil.emulated.faults.motor import UNPOWERED, on_shaft, weaker
from hil.emulated.faults.servo import servo_of
from hil.emulated.faults.shaft_fault import ShaftFault

PIECE_S = 0.002
"""Period of a look at the hand, s."""


class Looking(ShaftFault):
    """A fault that depends on the state of the hand, and looks at it every 2 ms."""

    def advance_to(self, t):
        while self.active and t - self.time > PIECE_S:
            self.behind.advance_to(self.time + PIECE_S)
            self.look()
        self.behind.advance_to(t)
        if self.active:
            self.look()

    def look(self):
        """See whether the fault acts now."""


class Wire(Looking):
    """A wire before some motors; `lost` says which part of the voltage stays in it at a sum of their efforts, N m."""

    def __init__(self, assembly, shafts, lost, *, is_plug):
        super().__init__(assembly.shafts, shafts[0])
        self._assembly, self._shafts, self._lost_at, self._is_plug = assembly, shafts, lost, is_plug
        self._lost = 0.0
        self._all_asked = dict.fromkeys(shafts, UNPOWERED)

    @property
    def supply_left(self):
        return 1.0 - self._lost if self._is_plug else 1.0

    def look(self):
        efforts = abs(self.behind.efforts())[list(self._shafts)].sum()
        # Half of the way at a time: the efforts follow the voltage.
        lost = 0.5 * (self._lost + self._lost_at(float(efforts) / (1.0 - self._lost), self.time))
        if abs(lost - self._lost) > 0.003:
            self._become(lost)

    def end(self):
        super().end()
        self._become(0.0)

    def drive(self, shaft, drive):
        if shaft in self._shafts:
            self._all_asked[shaft] = drive
            drive = weaker(drive, self._lost)
        self.behind.drive(shaft, drive)

    def set_setpoint(self, shaft, setpoint):
        if shaft in self._shafts:
            self._all_asked[shaft] = replace(self._all_asked[shaft], setpoint=setpoint)
        self.behind.set_setpoint(shaft, setpoint)

    def renew(self):
        for shaft in self._shafts:
            self.drive(shaft, self._all_asked[shaft])

    def _become(self, lost):
        self._lost = lost
        self.renew()
        if self._assembly.is_running:
            for shaft in self._shafts:
                servo = servo_of(self._assembly.electronics, Channel(shaft))
                servo.feedback.volts = self._assembly.unit.servos.voltage * (1.0 - lost)


class Mechanical(Looking):
    """Mechanical fault of a channel, updated from the state of the hand every 2 ms by `update`."""

    def __init__(self, assembly, fault):
        super().__init__(assembly.shafts, fault.where)
        self.assembly, self.severity = assembly, fault.severity

    @property
    def compiled(self):
        return self.assembly.mechanics.compiled

    @property
    def angle(self):
        return float(self.assembly.mechanics.state().angles[self.shaft])

    @property
    def tension(self):
        return float(self.assembly.mechanics.glimpse().tensions[self.shaft])

    def lengthen(self, longer_m):
        """Make the cable of the channel longer, m."""
        cable = self.compiled._cables[CABLES.index(self.shaft)]
        self.compiled.model.tendon_range[cable, 0] = -self.compiled.parameters.cable_take_up[self.shaft] - longer_m

    def rub(self, torque):
        """Add dry friction at the shaft of the channel, N m."""
        unit, compiled = self.compiled.parameters, self.compiled
        friction = unit.spool_friction[self.shaft] + torque
        if self.shaft in CABLES:
            compiled._spool_friction[CABLES.index(self.shaft)] = friction
        else:
            friction += unit.joint_friction[JOINTS[Channel(self.shaft)][0]]
        compiled.model.dof_frictionloss[compiled.shaft_dofs[self.shaft]] = friction


def watching(assembly, seconds, look, end=lambda: None):
    """Look again and again, and do what is to be done."""
    going = []

    def again(turn):
        if turn in going:
            assembly.advance()
            look()
            assembly.electronics.kernel.call_at(assembly.now() + seconds, again, turn)

    def begin():
        going.append(assembly.now())
        again(going[-1])

    return Active(begin, lambda: (going.clear(), end()))


def wire(shafts, lost, *, is_plug):
    """A bad wire before the motors of `shafts`; `lost` makes its law of an assembly and a fault."""
    return on_shaft(lambda assembly, fault: Wire(assembly, shafts, lost(assembly, fault), is_plug=is_plug))


def passing(direction, make):
    """A fault of the link; `make` gives the passage of an injection."""

    def put(side, fault):
        return Active(
            lambda: side.link.add(LinkEffect(fault, direction, make(side, fault))), lambda: side.link.remove(fault)
        )

    return put


def rewritten(change):
    """Every goal of the driver is another one; `change` maps its seven words."""

    def make(side, fault):
        def passed(data, now):
            if len(data) != FRAME_SIZE or data[0] != Opcode.CTRL_POS:
                return [(0.0, data)]
            opcode, filler, *words = FRAME.unpack(data)
            return [(0.0, FRAME.pack(opcode, filler, *change(words, fault.severity)))]

        return passed

    return make


def linked(name, part, words, put, severity=None):
    return LinkFault(name, FaultLayer.LINK, part, words, put, severity=severity, put=put)


def told(register, make):
    """Let a servo say something else of a register; `make(fault)` returns what makes it of time and value."""

    def inject(assembly, fault):
        change = make(fault)

        def spoil(answer, _severity, _random):
            return answer.with_register(register, lambda value: change(answer.now, value))

        def begin():
            assembly.electronics.bus.tap = assembly.electronics.bus.tap or SpoiledAnswers(
                assembly.electronics.kernel, assembly.fire
            )
            assembly.electronics.bus.tap.add(fault, spoil, assembly.random(fault))

        return Active(begin, lambda: assembly.electronics.bus.tap and assembly.electronics.bus.tap.remove(fault))

    return inject
