"""Five faults that a default run once passed: they come during the run, act while a digit opens, or shift a reading."""

from aero.channels import CABLES, FINGERS, Channel
from figures.strangers.helpers import Mechanical, told, wire
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Severity
from hil.emulated.faults.mechanics import JOINTS
from hil.emulated.faults.motor import on_shaft
from hil.verdict.part import Part

RUN_S = 200.0
"""Time of a default run, s."""
BENT_RAD, HELD_N, FREE_N, STICKS_NM = 1.2, 5.0, 2.0, 0.4
"""Angle and tension at which a finger sticks to the palm, tension at which it begins to peel off, its friction then."""


def falling(_assembly, fault):
    """A battery that loses a part of its voltage during a run."""
    begun = []

    def lost(_effort, t):
        begun[:] = begun or [t]
        return fault.severity * min((t - begun[0]) / RUN_S, 1.0)

    return lost


class Strand(Mechanical):
    """A broken strand that catches while the cable runs out."""

    def look(self):
        speed = float(self.assembly.mechanics.state().speeds[self.shaft])
        if abs(speed) > 0.05:
            self.rub(self.severity if speed < 0.0 else 0.0)

    def end(self):
        super().end()
        self.rub(0.0)


class Sticky(Mechanical):
    """A closed fingertip that sticks to the palm for some time after its cable has let it go."""

    sticks, let_go = False, None

    def look(self):
        first = float(self.assembly.mechanics.joint_angles()[JOINTS[Channel(self.shaft)][0]])
        if first > BENT_RAD and self.tension > HELD_N:
            self.sticks, self.let_go = True, None
        elif self.sticks and self.tension < FREE_N:
            self.let_go = self.time if self.let_go is None else self.let_go
            self.sticks = self.time - self.let_go < self.severity
        self.hold(STICKS_NM if self.sticks else 0.0)

    def end(self):
        super().end()
        self.hold(0.0)

    def hold(self, torque):
        """Add dry friction at the joints of the channel, N m."""
        for joint in JOINTS[Channel(self.shaft)]:
            friction = self.compiled.parameters.joint_friction[joint] + torque
            self.compiled.model.dof_frictionloss[self.compiled.joint_dofs[joint]] = friction


class WalksOut(Mechanical):
    """A hinge whose pin walks out during a run, so that the cable becomes longer."""

    begun = None

    def look(self):
        self.begun = self.time if self.begun is None else self.begun
        self.lengthen(self.severity * min((self.time - self.begun) / RUN_S, 1.0))

    def end(self):
        super().end()
        self.lengthen(0.0)


def displaced(fault):
    """A current sensor whose zero is off."""
    return lambda _, value: value + round(fault.severity)


def _around(unit, size):
    return Severity(unit, (size / 2.0, size, 2.0 * size), 0.0, 1e4)


L, D = FaultLayer, Part.DIGIT
# fmt: off
FIVE = (
    Fault("battery_falls", L.SUPPLY, Part.SUPPLY, "a battery falls during the run",
          wire(tuple(ALL), falling, is_plug=True), severity=_around("of voltage lost in a run", 0.28)).at(0.28),
    # of the winding's layer: what is put behind the shafts needs the mechanics built
    Fault("strand_catches", L.WINDING, D, "a strand catches while the cable runs out",
          on_shaft(Strand), CABLES, _around("N m", 0.1)).at(0.1, Channel.RING),
    Fault("fingertip_sticks", L.WINDING, D, "a closed fingertip sticks",
          on_shaft(Sticky), FINGERS, _around("s", 1.2)).at(1.2, Channel.INDEX),
    Fault("hinge_walks_out", L.WINDING, D, "a hinge walks out, and its cable becomes longer",
          on_shaft(WalksOut), CABLES, _around("m in a run", 0.006)).at(0.006, Channel.MIDDLE),
    Fault("current_zero_off", L.SERVO, Part.SERVO, "a current zero is off by 182 mA",
          told("present_current", displaced), ALL, _around("6.5 mA", 28.0)).at(28.0, Channel.MIDDLE),
)
# fmt: on
