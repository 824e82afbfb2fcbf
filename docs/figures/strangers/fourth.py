"""A fourth set of faults that no catalogue has, written after the rules had been mended by the first three.

Whoever writes rules of a diagnosis does not read this file. Made stronger after the first look, as a validation saw
nothing, or too little of what it should do: sheath_unseated, fed_back.
"""

import math
from dataclasses import replace

from aero.channels import CABLES, FINGERS, Channel
from figures.strangers.first import Contact, added, both, finger_joints, in_registers, scaled, unit, watching
from firmware_emulator.firmware.frames import FRAME, Opcode
from firmware_emulator.servo.memory import encode_signed
from firmware_emulator.servo.models import REGISTERS
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.bus import SpoiledAnswers
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Severity, share
from hil.emulated.faults.link import LinkFault
from hil.emulated.faults.link_faults import LinkEffect
from hil.emulated.faults.mechanics import JOINTS
from hil.emulated.faults.motor import UNPOWERED, Motor, on_shaft
from hil.emulated.faults.servo import servo_of
from hil.emulated.faults.shaft_fault import ShaftFault
from hil.verdict.part import Part
from model.geometry.winding import SPOOL_RADIUS

CABLE, JOINT, GEAR, BOARD = FaultLayer.CABLE, FaultLayer.JOINT, FaultLayer.GEAR, FaultLayer.BOARD
MOTOR, SUPPLY, BUS, SERVO = FaultLayer.MOTOR, FaultLayer.SUPPLY, FaultLayer.BUS, FaultLayer.SERVO
GOAL = REGISTERS["acceleration"].address


def rubs_when(when):
    """Let a cable rub from when `when` says so of its spool's angle and speed until it says no."""

    def inject(assembly, fault):
        caught = [False]

        def rub(force):
            compiled, at = assembly.mechanics.compiled, CABLES.index(fault.where)
            compiled._spool_friction[at] = compiled.parameters.spool_friction[fault.where] + SPOOL_RADIUS * force

        def look():
            state, tensions = assembly.mechanics.state(), assembly.mechanics.glimpse().tensions
            speed = state.speeds[fault.where]
            now = when(state.angles[fault.where], speed)
            caught[0] = caught[0] if now is None else now
            # Where it holds a cable back that runs out, the spool feels no more than the tension before.
            rub(caught[0] * min(fault.severity, tensions[fault.where] if speed < 0.0 else math.inf))

        return watching(assembly, 0.005, look, lambda: rub(0.0))

    return inject


def oval(assembly, fault):
    """Let a spool have a longer lever on two sides, a shorter one between."""

    def look():
        hand = assembly.mechanics
        lever = fault.severity * SPOOL_RADIUS * math.cos(2.0 * hand.state().angles[fault.where])
        hand.twist(fault.where, -lever * hand.glimpse().tensions[fault.where])

    return watching(assembly, 0.005, look, lambda: assembly.mechanics.twist(fault.where, 0.0))


class _Anew(Motor):
    """A motor of whose drive `change` makes another, at every moment anew."""

    def __init__(self, assembly, fault, change):
        super().__init__(assembly.shafts, fault.where, lambda drive: change(drive, assembly.mechanics, fault))

    def advance_to(self, t):
        super().advance_to(t)
        if self.active:
            self.renew()


class _Breaks(Contact):
    """A supply that breaks down above a level of something, until it is half of that."""

    def __init__(self, assembly, fault, lost, level):
        super().__init__(assembly.shafts, lost, assembly)
        self._now, self._level = 0.0, lambda span: level(self._now, span, self.behind.state(), fault.severity)

    def advance_to(self, t):
        span = t - self.time
        ShaftFault.advance_to(self, t)
        self._now = self._level(span) if self.active and self._assembly.is_running else 0.0
        if self._bad != (self._now > (0.5 if self._bad else 1.0)):
            self._bad = not self._bad
            self._assembly.electronics.supply(6.0 * self.supply_left)
            self.renew()

    def end(self):
        super().end()
        self._assembly.electronics.supply(6.0)


def goals_taken(change):
    """Let a servo take another goal than it was sent, none where `change` makes None of it."""

    def inject(assembly, fault):
        servo, random = servo_of(assembly.electronics, fault.where), assembly.random(fault)
        right = servo.write

        def write(address, data):
            taken = change(data, fault.severity, random) if address == GOAL else data
            if taken != data:
                assembly.fire(fault)
            if taken is not None:
                right(address, taken)

        return Active(lambda: setattr(servo, "write", write), lambda: servo.__dict__.pop("write", None))

    return inject


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


def delayed(seconds):
    """Return what tells values of some time ago."""
    known = []

    def change(now, value):
        known.append((now, value))
        while len(known) > 1 and known[1][0] <= now - seconds:
            known.pop(0)
        return known[0][1]

    return change


def lifted(assembly, fault):
    """Let a spool lift the plug of the servo beside it while it is wound up."""

    def look():
        if assembly.mechanics.state().angles[Channel.RING] > fault.severity:
            assembly.fire(fault)
            servo_of(assembly.electronics, fault.where).silent_until = assembly.now() + 0.015

    return watching(assembly, 0.01, look)


def homed_on_something(assembly, fault):
    """Let four fingers have the zeros that homing found on something that stopped them early; homing mends it."""

    def begin():
        for servo in (servo_of(assembly.electronics, finger) for finger in FINGERS):
            reads = servo.frame.counts(servo._angle())
            servo.calibrate(encode_signed(reads + round(math.copysign(fault.severity, servo.frame.counts_per_rad))))

    return Active(begin)


def passing(name, part, words, make, severity=None, *, way="from_hand", alike=(), at_s=0.0):
    """A fault of the pieces of a link; `make(fault, side)` returns what does it."""

    def put(side, fault):
        passage = make(fault, side)
        return Active(lambda: side.link.add(LinkEffect(fault, way, passage)), lambda: side.link.remove(fault))

    return LinkFault(name, FaultLayer.LINK, part, words, put, (), severity, at_s, alike=alike, put=put)


def on_words(name, part, words, make, severity=None, **more):
    """A fault of the words of frames; `make(fault)` returns what makes others of opcode, words and time."""

    def passage(fault, _side):
        change = make(fault)

        def passed(data, now):
            code, _, *found = FRAME.unpack(data) if len(data) == FRAME.size else (None, 0)
            return [(0.0, data if code is None else FRAME.pack(code, 0, *change(code, found, now)))]

        return passed

    return passing(name, part, words, passage, severity, **more)


def torn(fault):
    """Return what lets the thumb's positions be older than the fingers'."""
    old = delayed(1e-3 * fault.severity)
    return lambda code, words, now: [*old(now, words[:3]), *words[3:]] if code == Opcode.GET_POS else words


def one_behind(_fault):
    """Return what sends the command before."""
    sent = []
    return lambda code, words, _: (sent.append(words) or sent[-2:][0]) if code == Opcode.CTRL_POS else words


# fmt: off
FAULTS = (
    (Fault("knot_at_a_guide", CABLE, Part.DIGIT, "a knot in a cable rubs through a guide",
           rubs_when(lambda angle, _: 1.5 < angle < 3.0), FINGERS, Severity("N", (5, 11, 22)), 0.5), Channel.INDEX),
    (unit("rests_bent", JOINT, Part.DIGIT, "a spring was put in so that its joint rests bent",
          added("spring_open", lambda fault: [JOINTS[fault.where][1]], lambda nm: -nm),
          FINGERS, Severity("N m", (0.08, 0.12, 0.18))), Channel.MIDDLE),
    (unit("lead_pulls_back", JOINT, Part.DIGIT, "a lead tied too short pulls the thumb back",
          both(added("spring_closed", lambda fault: JOINTS[fault.where], lambda nm: nm),
               added("spring_open", lambda fault: JOINTS[fault.where], lambda nm: 0.3 * nm)),
          (Channel.THUMB_ABDUCTION,), Severity("N m", (0.06, 0.15, 0.3))), None),
    (Fault("oval_spool", CABLE, Part.DIGIT, "a spool is not round",
           oval, CABLES, share("of its radius", 0.1, 0.25, 0.4), 0.5), Channel.PINKY),
    (unit("sheath_unseated", CABLE, Part.DIGIT, "a sheath is off its seats: its cable runs free, and is slack",
          both(scaled("cable_friction", lambda fault: [fault.where], lambda off: 1.0 - off),
               added("cable_take_up", lambda fault: [fault.where], lambda off: 8e-3 * off)),
          FINGERS, share("it", 0.7, 1.0, 1.0)), Channel.RING),
    (Fault("strand_as_a_barb", CABLE, Part.DIGIT, "a broken strand catches when a cable runs out",
           rubs_when(lambda _, speed: None if abs(speed) < 0.05 else speed < 0.0), CABLES, Severity("N", (5, 12, 25)),
           0.5), Channel.THUMB_CMC_FLEXION),
    (unit("springs_of_a_finger", JOINT, Part.DIGIT, "the thumb has springs of a finger",
          added("spring_open", lambda fault: JOINTS[fault.where], lambda _: 0.05), (Channel.THUMB_FLEXOR,)), None),
    (in_registers("seven_volt_settings", "a servo has the voltage limits of a 7.4 V hand",
                  lambda *_: {"min_voltage": 65, "unload_conditions": 45}), Channel.THUMB_ABDUCTION),
    # Homing puts the mode right.
    (replace(in_registers("mode_left", "a servo was left in another mode", lambda *_: {"mode": 2}, None, 20.0),
             alike=(Part.SETUP,)), Channel.MIDDLE),
    (Fault("tells_late", BUS, Part.SERVO, "a servo tells positions of some time ago",
           told("present_position", lambda fault: delayed(1e-3 * fault.severity)), ALL, Severity("ms", (30, 70, 160))),
     Channel.RING),
    (Fault("burnt_coil", MOTOR, Part.SERVO, "a coil is burnt: no torque for a part of every turn of a rotor",
           on_shaft(lambda *it: _Anew(*it, lambda drive, hand, fault: drive if fault.severity
                    < 36.0 * hand.angles()[fault.where] / math.tau % 1.0 else UNPOWERED)),
           ALL, share("a turn", 0.15, 0.35, 0.6)), Channel.INDEX),
    (Fault("current_displaced", BUS, Part.SERVO, "a servo's current has another zero",
           told("present_current", lambda fault: lambda _, value: value + round(fault.severity)), ALL,
           Severity("6.5 mA", (50, 120, 300))), Channel.THUMB_CMC_FLEXION),
    (Fault("soft_start", SERVO, Part.SERVO, "a servo's acceleration was bounded",
           goals_taken(lambda goal, most, _: bytes((min(goal[0] or 254, round(most)),)) + goal[1:]), ALL,
           Severity("100 counts/s^2", (200, 80, 25), 1, 254)), Channel.PINKY),
    (unit("binds_under_load", GEAR, Part.SERVO, "gears bind when they pull",
          added("cable_friction", lambda fault: [fault.where], lambda by: by), ALL,
          Severity("of the torque", (0.2, 0.5, 1.0))), Channel.THUMB_FLEXOR),
    (Fault("hunts", MOTOR, Part.SERVO, "a servo hunts about its goal, four times a second",
           on_shaft(lambda *it: _Anew(*it, lambda drive, hand, fault: replace(
               drive, setpoint=drive.setpoint + fault.severity * math.sin(4.0 * math.tau * hand.time)))),
           ALL, Severity("rad", (0.02, 0.05, 0.1))), Channel.MIDDLE),
    (on_words("words_shifted", Part.BOARD, "replies begin a word too late after a while", lambda _: lambda code, words,
              _now: [words[-1], *words[:-1]] if Opcode.GET_POS <= code <= Opcode.GET_TEMP else words,
              alike=(Part.DRIVER,), at_s=40.0), None),
    (on_words("clipped", Part.BOARD, "positions are cut off above", lambda fault: lambda code, words, _:
              [min(word, round(fault.severity)) for word in words] if code == Opcode.GET_POS else words,
              Severity("codes", (57343, 49151, 32767)), alike=(Part.DRIVER,)), None),
    (on_words("torn", Part.BOARD, "the thumb's positions are older than the fingers'", torn,
              Severity("ms", (30, 80, 200)), alike=(Part.DRIVER,)), None),
    (on_words("one_behind", Part.DRIVER, "the driver sends the command before", one_behind, way="to_hand",
              alike=(Part.BOARD,)), None),
    (on_words("raw_sign", Part.DRIVER, "the driver takes the sign of currents for a bit of its own",
              lambda _: lambda code, words, _now: [0x18000 - word if word > 0x8000 else word for word in words]
              if code == Opcode.GET_CURR else words, alike=(Part.BOARD,)), None),
    (passing("slower_and_slower", Part.COMPUTER, "the program becomes slower and slower",
             lambda fault, _: lambda data, now: [(min(1e-3 * fault.severity * now, 0.06), data)],
             Severity("ms/s", (0.2, 0.6, 2.0)), alike=(Part.USB,)), None),
    (passing("serial_monitor", Part.COMPUTER, "another program reads the ends of some replies", lambda fault, _:
             lambda data, now: [(0.0, data[:9] if now % 0.07 < 0.07 * fault.severity else data)],
             share("time", 0.04, 0.1, 0.2), alike=(Part.USB,), at_s=25.0), None),
    (passing("tugged", Part.USB, "the thumb pulls at the USB plug when it is across", lambda fault, side:
             lambda data, now: [(0.0, data)] * (side.mechanics.state().angles[Channel.THUMB_ABDUCTION] < 0.9
             or now % 0.05 > 0.05 * fault.severity), share("time", 0.1, 0.3, 0.8), alike=(Part.BOARD,)), None),
    (passing("sent_again", Part.USB, "motors that work disturb a cable, and a hub sends again and again",
             lambda fault, side: lambda data, _: [(min(sum(map(abs, side.mechanics.efforts())), 1.0)
             * 1e-3 * fault.severity, data)], Severity("ms", (8, 25, 80)), alike=(Part.COMPUTER,)), None),
    (Fault("hears_badly", BUS, Part.BUS, "a plug's contact is bad: long packets are missed",
           goals_taken(lambda goal, missed, random: None if random.random() < missed else goal),
           ALL, share("goals", 0.2, 0.4, 0.7), alike=(Part.SERVO,)), Channel.PINKY),
    (Fault("lifted_plug", BUS, Part.BUS, "a spool lifts the plug beside it", lifted, (Channel.MIDDLE,),
           Severity("rad", (4.0, 2.5, 1.5)), 0.5, alike=(Part.SERVO,)), None),
    (Fault("warm_fuse", SUPPLY, Part.SUPPLY, "a fuse opens when it is warm", on_shaft(lambda *it: _Breaks(
           *it, 0.7, lambda warm, span, state, works: min(max(warm + span * (sum(map(abs, state.efforts)) - 0.25)
           / works, 0.0), 1.2))), (), Severity("N m s", (20, 8, 3)), 0.5), None),
    (Fault("fed_back", SUPPLY, Part.SUPPLY, "the supply gives way when motors that brake feed it", on_shaft(
           lambda *it: _Breaks(*it, 0.6, lambda left, span, state, power: 1.1 if -power > sum(map(
               lambda effort, speed: (effort - 0.046 * speed) * speed, state.efforts, state.speeds))  # less back-EMF
               else left - 0.7 * span)),
           (), Severity("W", (12, 5, 2)), 0.5), None),
    (unit("soft_ball", JOINT, Part.SETUP, "the hand holds a soft ball",
          added("spring_closed", finger_joints, lambda nm: nm), (), Severity("N m", (0.04, 0.1, 0.25))), None),
    (Fault("homed_on_something", BOARD, Part.SETUP, "fingers were homed on something that they held",
           homed_on_something, (), Severity("counts", (100, 250, 500)), 20.0), None),
)
# fmt: on
FOURTH = tuple(
    fault.at(fault.steps()[-1] if fault.severity and i % 2 else None, channel)
    for i, (fault, channel) in enumerate(FAULTS)
)
"""Thirty injections, medium and severe by turns."""
