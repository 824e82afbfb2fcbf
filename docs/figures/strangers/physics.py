"""Faults drawn as physics: parameters of a part that are off, constantly, by posture, by heat or by time.

A fault has no name of its own. Drawn are the part, the parameter, its size between a size that harms little and one
that harms plainly, and the time at which it acts. The truth is the part. A parameter of a fixed value can be felt and
seen; one that comes and goes is there only while the hand moves, warms up, or lives.
"""

import math
from dataclasses import dataclass
from random import Random

from aero.channels import CABLES, FINGERS, Channel
from figures.strangers.helpers import Mechanical, linked, passing, rewritten, told, watching, wire
from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.emulated.faults.encoder import Encoder
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Injection, Severity
from hil.emulated.faults.mechanics import JOINTS, another_unit, with_values
from hil.emulated.faults.motor import Motor, on_shaft, weaker
from hil.emulated.faults.servo import servo_of
from hil.verdict.part import Part

BENT_RAD = 2.5
"""Angle of a spool at which a fault by posture acts."""
WARM_C, HOT_C = 28.0, 40.0
"""Temperatures of the servo at which a fault by heat begins, and acts in full."""
ON_S, OFF_S = 2.0, 5.0
"""Mean times of a fault by time with and without effect, s."""


def constant(_assembly, _channel, _random):
    """Act always."""
    return lambda: 1.0


def by_posture(assembly, channel, _random):
    """Act while the digit is bent; without a channel, while some digit is."""
    shafts = list(ALL) if channel is None else [channel]
    return lambda: float(max(abs(assembly.mechanics.state().angles[shaft]) for shaft in shafts) > BENT_RAD)


def by_heat(assembly, channel, _random):
    """Act more as a servo warms up."""

    channels = ALL if channel is None else (channel,)

    def part():
        if not assembly.is_running:
            return 0.0
        hottest = max(servo_of(assembly.electronics, one).feedback.temperature_c for one in channels)
        return min(max((hottest - WARM_C) / (HOT_C - WARM_C), 0.0), 1.0)

    return part


def by_time(assembly, _channel, random):
    """Act for some seconds, again and again, at random."""
    state = [0.0, 0.0]

    def part():
        if not assembly.is_running:
            return 0.0
        while assembly.now() >= state[1]:
            state[:] = 1.0 - state[0], state[1] + random.expovariate(1.0 / (OFF_S if state[0] else ON_S))
        return state[0]

    return part


WHEN = {"": constant, "by posture": by_posture, "by heat": by_heat, "by time": by_time}


class Turning(Mechanical):
    """A mechanical parameter that follows the time at which a fault acts."""

    def __init__(self, assembly, fault, when, put):
        super().__init__(assembly, fault)
        self._when, self._put = when(assembly, fault.where, assembly.random(fault)), put

    def look(self):
        self._put(self, self.severity * self._when())

    def end(self):
        super().end()
        self._put(self, 0.0)


def mechanical(put):
    """A parameter of cable or gears; `put` sets it on a `Mechanical`."""
    return lambda when: on_shaft(lambda assembly, fault: Turning(assembly, fault, when, put))


def of_unit(field, change):
    """A parameter of the joints of a digit; it is constant whatever was drawn, and can be felt."""

    def changed(unit, fault):
        return with_values(unit, field, JOINTS[fault.where], lambda was: change(was, fault.severity))

    return lambda when: another_unit(changed)


def weak(when):
    """Torque that a motor loses."""

    def make(assembly, fault):
        part = when(assembly, fault.channel, assembly.random(fault))
        motor = Motor(assembly.shafts, fault.where, lambda drive: weaker(drive, min(fault.severity * part(), 0.99)))
        advance = motor.advance_to
        motor.advance_to = lambda t: (advance(t), motor.renew() if motor.active and when is not constant else None)
        return motor

    return on_shaft(make)


def reading(law):
    """An encoder that reads otherwise; `law` of the true angle and the size."""

    def injected(when):
        def make(assembly, fault):
            part = when(assembly, fault.channel, assembly.random(fault))
            return Encoder(assembly.shafts, fault.where, lambda true, _: law(true, fault.severity * part()))

        return on_shaft(make)

    return injected


def told_current(change):
    """A current sensor that says something else."""
    return lambda when: told("present_current", lambda fault: lambda _, value: round(change(value, fault.severity)))


def lossy_supply(law):
    """A supply that loses part of its voltage; `law` of the size, the sum of efforts and the healthy unit."""

    def injected(when):
        def lost(assembly, fault):
            part = when(assembly, None, assembly.random(fault))
            return lambda effort, _: min(law(fault.severity, effort, assembly.healthy) * part(), 0.9)

        return wire(tuple(ALL), lost, is_plug=True)

    return injected


def loose_plug(when):
    """A servo that is off the bus for a moment, at random."""

    def inject(assembly, fault):
        random = assembly.random(fault)
        part = when(assembly, fault.channel, random)

        def look():
            if random.random() < 0.05 * fault.severity * part():
                servo_of(assembly.electronics, fault.where).silent_until = assembly.now() + 0.15

        return watching(assembly, 0.05, look)

    return inject


def on_link(direction, change):
    """Bytes that arrive otherwise; `change` of the bytes, the size and random numbers returns pieces."""

    def injected(when):
        def make(side, fault):
            random = side.random(fault)
            part = when(side, None, random)
            return lambda data, now: change(data, fault.severity * part(), random)

        return passing(direction, make)

    return injected


def loses(data, size, random):
    return [] if random.random() < size else [(0.0, data)]


def flips(data, size, random):
    if random.random() >= size:
        return [(0.0, data)]
    at = random.randrange(len(data))
    return [(0.0, data[:at] + bytes([data[at] ^ 1 << random.randrange(8)]) + data[at + 1 :])]


def delays(data, size, random):
    return [(size * random.random(), data)]


def stalls(data, size, random):
    return [(size if random.random() < 0.004 else 0.0, data)]


def goals(change):
    """Goals that arrive otherwise; `change` of one word and the size, at the thumb and all fingers."""
    return lambda when: passing("to_hand", rewritten(lambda words, size: [round(change(word, size)) for word in words]))


@dataclass(frozen=True)
class Parameter:
    """Parameter of a part that can be off."""

    words: str
    part: Part
    layer: FaultLayer
    channels: tuple[Channel, ...]
    least: float
    most: float
    """Sizes between which a fault is drawn, evenly in their logarithm."""
    inject: object
    times: tuple[str, ...] = tuple(WHEN)


L, S, D = FaultLayer, Part.SERVO, Part.DIGIT
# fmt: off
PARAMETERS = (
    Parameter("torque lost", S, L.MOTOR, ALL, 0.2, 0.95, weak),
    # of the motor's layer: what is put behind the shafts needs the mechanics built
    Parameter("gear friction, N m", S, L.MOTOR, ALL, 0.05, 0.4, mechanical(Mechanical.rub)),
    Parameter("encoder scale off", S, L.ENCODER, ALL, 0.03, 0.3, reading(lambda true, x: true * (1.0 + x)), ("",)),
    Parameter("encoder ripple, counts", S, L.ENCODER, ALL, 30.0, 300.0,
              reading(lambda true, x: true + x * RAD_PER_COUNT * math.sin(3.0 * true))),
    Parameter("current read off, 6.5 mA", S, L.SERVO, ALL, 15.0, 120.0, told_current(lambda v, x: v + x), ("",)),
    Parameter("current read times", S, L.SERVO, ALL, 1.3, 3.0, told_current(lambda v, x: v * x), ("",)),
    Parameter("cable longer, m", D, L.WINDING, CABLES, 0.002, 0.015, mechanical(Mechanical.lengthen)),
    Parameter("cable rubs, N m", D, L.WINDING, CABLES, 0.05, 0.4, mechanical(Mechanical.rub)),
    Parameter("joint friction, N m", D, L.JOINT, ALL, 0.04, 0.3,
              of_unit("joint_friction", lambda was, x: was + x), ("",)),
    Parameter("spring stiffer, share", D, L.JOINT, FINGERS, 0.4, 2.5,
              of_unit("spring_closed", lambda was, x: was * (1.0 + x)), ("",)),
    Parameter("closed stop, share of travel lost", D, L.JOINT, FINGERS, 0.08, 0.5,
              of_unit("closed_stop", lambda was, x: was * (1.0 - x)), ("",)),
    Parameter("supply low, share", Part.SUPPLY, L.SUPPLY, (), 0.15, 0.45, lossy_supply(lambda x, _e, _u: x)),
    Parameter("supply sags at stall, share", Part.SUPPLY, L.SUPPLY, (), 0.4, 0.9,
              lossy_supply(lambda x, effort, unit: x * effort / (7.0 * unit.servos.stall_torque))),
    Parameter("plug opens, per s", Part.BUS, L.BUS, ALL, 0.3, 5.0, loose_plug),
    Parameter("replies lost, share", Part.USB, L.LINK, (), 0.005, 0.1, on_link("from_hand", loses)),
    Parameter("bits flipped, share of frames", Part.USB, L.LINK, (), 0.005, 0.1, on_link("from_hand", flips)),
    Parameter("replies late, s", Part.USB, L.LINK, (), 0.01, 0.06, on_link("from_hand", delays)),
    Parameter("commands stall, s", Part.COMPUTER, L.LINK, (), 0.3, 1.0, on_link("to_hand", stalls)),
    Parameter("replies of the board late, s", Part.BOARD, L.LINK, (), 0.01, 0.06, on_link("from_hand", delays)),
    Parameter("goals scaled by the board, share lost", Part.BOARD, L.LINK, (), 0.1, 0.5,
              goals(lambda word, x: word * (1.0 - x)), ("",)),
    Parameter("goals scaled by the driver, share lost", Part.DRIVER, L.LINK, (), 0.1, 0.5,
              goals(lambda word, x: word * (1.0 - x)), ("",)),
)
# fmt: on


def drawn_physics(seed: int) -> Injection:
    """Return a fault drawn by a seed: part, then parameter, size, time and channel."""
    random = Random(seed)
    parts = sorted({one.part for one in PARAMETERS}, key=lambda part: part.name)
    # a digit and a servo are seven each
    part = random.choices(parts, [7 if one in (S, D) else 2 for one in parts])[0]
    one = random.choice([parameter for parameter in PARAMETERS if parameter.part is part])
    time, size = random.choice(one.times), math.exp(random.uniform(math.log(one.least), math.log(one.most)))
    channel = random.choice(one.channels) if one.channels else None
    name = f"physics_{seed}_{one.words.split(',')[0].replace(' ', '_')}{'_' if time else ''}{time.replace(' ', '_')}"
    severity = Severity("", (one.least, size, one.most), 0.0, 1e4)
    inject = one.inject(WHEN[time])
    if one.layer is FaultLayer.LINK:
        return linked(name, part, one.words, inject, severity).at(size)
    return Fault(name, one.layer, part, one.words, inject, one.channels, severity).at(size, channel)
