"""Faults that no catalogue has, each with the part that is at fault: what a diagnosis must find without a row for it.

`FIRST` are injections, used as those of the catalogue are, in this process: `open_target(faults=[FIRST[0]])`.
Whoever writes rules of a diagnosis does not read this file.
"""

import math
import struct
from dataclasses import dataclass, replace

import numpy as np

from aero.channels import FINGERS, WIRE_ORDER, Channel, Joint
from firmware_emulator.plant import Drive
from firmware_emulator.servo.models import REGISTERS
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Severity, share
from hil.emulated.faults.link import LinkFault
from hil.emulated.faults.link_faults import LinkEffect
from hil.emulated.faults.mechanics import JOINTS, another_unit, with_values
from hil.emulated.faults.motor import on_shaft, weaker
from hil.emulated.faults.servo import servo_of, store
from hil.emulated.faults.shaft_fault import ShaftFault
from hil.verdict.part import Part

CABLE, JOINT = FaultLayer.CABLE, FaultLayer.JOINT
FRAME = struct.Struct("<BB7H")
CTRL_POS, GET_POS, GET_CURR, GET_TEMP = 0x11, 0x22, 0x24, 0x25
DIGITS = (*FINGERS, Channel.THUMB_FLEXOR)


def unit(name, layer, part, words, change, *where, **more):
    return Fault(name, layer, part, words, another_unit(change), *where, **more)


def scaled(field, where, factor):
    return lambda one, fault: with_values(one, field, where(fault), lambda value: value * factor(fault.severity))


def both(*changes):
    def changed(one, fault):
        for change in changes:
            one = change(one, fault)
        return one

    return changed


def added(field, where, amount):
    return lambda one, fault: with_values(one, field, where(fault), lambda value: value + amount(fault.severity))


def last_joint(fault):
    return [JOINTS[fault.where][-1]]


def middle_joint(fault):
    return [JOINTS[fault.where][len(JOINTS[fault.where]) // 2]]


def fingers(_fault):
    return list(FINGERS)


def finger_joints(_fault):
    return [joint for finger in FINGERS for joint in JOINTS[finger]]


# A spring that pulls less closed than open is refused, also on the way: the closed end follows the open one.
def less_spring(where):
    return both(
        scaled("spring_open", where, lambda lost: 1.0 - lost), scaled("spring_closed", where, lambda lost: 1.0 - lost)
    )


def slipping(assembly, fault):
    """Let a cable out a little at a time, ten times in a minute."""
    there = []

    def slip(step):
        for active in there:
            active.clear()
        out = added("cable_take_up", lambda fault: [fault.where], lambda mm: 1e-4 * step * mm)
        there[:] = [assembly.changed(lambda one: out(one, fault))]
        there[0].begin()
        if step < 10:
            assembly.electronics.kernel.call_at(assembly.now() + 6.0, go_on, step + 1)

    def go_on(step):
        if there:
            slip(step)

    def clear():
        for active in there:
            active.clear()
        there.clear()

    return Active(lambda: slip(1), clear)


class Fading(ShaftFault):
    """A motor that loses torque while it works, and gets it back while it rests."""

    def __init__(self, behind, shaft, lost, seconds):
        super().__init__(behind, shaft)
        self._lost, self._seconds = lost, seconds
        self.warm = self._told = 0.0

    def advance_to(self, t):
        span = t - self.time
        super().advance_to(t)
        if span <= 0.0 or not self.active:
            return
        works = abs(float(self.behind.efforts()[self.shaft])) > 0.02
        self.warm = min(max(self.warm + span * (1.0 / self._seconds if works else -0.01), 0.0), 1.0)
        if abs(self.warm - self._told) > 0.02:
            self._told = self.warm
            self.renew()

    def changed(self, drive):
        return weaker(drive, self._lost * self.warm)


class Toothless(ShaftFault):
    """Gears that slip for a stretch of every turn of the shaft."""

    def __init__(self, behind, shaft, stretch):
        super().__init__(behind, shaft)
        self._stretch, self._slips = stretch, False

    def advance_to(self, t):
        super().advance_to(t)
        at = float(self.behind.angles()[self.shaft]) % 1.5
        slips = 0.7 < at < 0.7 + self._stretch
        if self.active and slips != self._slips:
            self._slips = slips
            self.renew()

    def changed(self, drive):
        return weaker(drive, 0.9) if self._slips else drive


class Eccentric(ShaftFault):
    """A magnet beside its axis: the reading is wrong twice a turn."""

    def __init__(self, behind, shaft, amplitude):
        super().__init__(behind, shaft)
        self._amplitude = amplitude

    def _error(self):
        return self._amplitude * math.sin(4.0 * float(self.behind.angles()[self.shaft]))

    def advance_to(self, t):
        super().advance_to(t)
        if self.active and self.asked.stiffness:
            self.behind.set_setpoint(self.shaft, self.asked.setpoint - self._error())

    def angles(self):
        angles = self.behind.angles()
        if self.active:
            angles[self.shaft] += self._error()
        return angles

    def changed(self, drive):
        return replace(drive, setpoint=drive.setpoint - self._error())


class Lead(ShaftFault):
    """A servo's wires that open while the thumb is across: no power, and nothing on the bus."""

    ACROSS_RAD = 0.6

    def __init__(self, behind, shaft, electronics):
        super().__init__(behind, shaft)
        self._electronics, self._open = electronics, False

    def advance_to(self, t):
        super().advance_to(t)
        is_open = self.active and float(self.behind.angles()[Channel.THUMB_ABDUCTION]) > self.ACROSS_RAD
        if is_open != self._open:
            self._open = is_open
            servo_of(self._electronics(), Channel(self.shaft)).silent_until = math.inf if is_open else -1.0
            self.renew()

    def end(self):
        super().end()
        servo_of(self._electronics(), Channel(self.shaft)).silent_until = -1.0

    def changed(self, drive):
        return Drive(powered=False) if self._open else drive


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


class Contact(ShaftFault):
    """A supply whose contact is bad: for a part of every period all motors have a part of the voltage."""

    PERIOD_S, BAD_S = 2.5, 0.6

    def __init__(self, behind, lost, assembly):
        super().__init__(behind, 0)
        self._lost, self._bad, self._assembly = lost, False, assembly
        self._all = [Drive(powered=False)] * len(Channel)

    @property
    def supply_left(self):
        return 1.0 - self._lost * self._bad

    def advance_to(self, t):
        super().advance_to(t)
        bad = self.active and self._assembly.is_running and self.time % self.PERIOD_S < self.BAD_S
        if bad != self._bad:
            self._bad = bad
            if self.active:
                self._assembly.electronics.supply(6.0 * self.supply_left)
            self.renew()

    def drive(self, shaft, drive):
        self._all[shaft] = drive
        self.behind.drive(shaft, weaker(drive, self._lost) if self._bad else drive)

    def set_setpoint(self, shaft, setpoint):
        self._all[shaft] = replace(self._all[shaft], setpoint=setpoint)
        self.behind.set_setpoint(shaft, setpoint)

    def renew(self):
        for shaft, drive in enumerate(self._all):
            self.drive(shaft, drive)


def in_registers(name, words, values, severity=None, at_s=0.0):
    """A fault that is other settings in a servo, in EEPROM and in what is copied from it; `values` makes them."""

    def inject(assembly, fault):
        servo = servo_of(assembly.electronics, fault.where)
        wrong = values(assembly, fault)
        right = {register: servo.memory.get(register) for register in wrong}

        def put(settings):
            for register, value in settings.items():
                if REGISTERS[register].address < 40:
                    store(servo, register, value)
                else:
                    servo.write(REGISTERS[register].address, value.to_bytes(REGISTERS[register].size, "little"))

        return Active(lambda: put(wrong), lambda: put(right))

    return Fault(name, FaultLayer.SERVO, Part.SERVO, words, inject, ALL, severity, at_s)


def angle_limit(assembly, fault):
    """Return limits that leave a part of the window, where the window lies within one turn."""
    at = WIRE_ORDER.index(fault.where)
    window = assembly.electronics.board.window
    ends = window.extend[at], window.grasp[at]
    stop = min(max(round(ends[0] + fault.severity * (ends[1] - ends[0])), 1), 4094)
    return {"min_angle": 0, "max_angle": stop} if ends[1] > ends[0] else {"min_angle": stop, "max_angle": 4095}


def on_frames(name, part, words, change, severity=None, *, replies=True, alike=(), at_s=0.0):
    """A fault that alters whole frames of one direction; `change(opcode, words, severity, now)` returns the words."""

    def put(side, fault):
        def passage(data, now):
            out = bytearray(data)
            for at in range(0, len(data) - FRAME.size + 1, FRAME.size):
                opcode, filler, *found = FRAME.unpack_from(data, at)
                changed = change(opcode, list(found), fault.severity, now)
                FRAME.pack_into(out, at, opcode, filler, *(int(word) & 0xFFFF for word in changed))
            return [(0.0, bytes(out))]

        effect = LinkEffect(fault, "from_hand" if replies else "to_hand", passage)
        return Active(lambda: side.link.add(effect), lambda: side.link.remove(fault))

    return LinkFault(name, FaultLayer.LINK, part, words, put, (), severity, at_s, alike=alike, put=put)


def reordered(opcodes):
    def change(opcode, words, severity, now):
        if opcode in opcodes:
            words[0], words[1:4] = words[3], words[0:3]
        return words

    return change


def both_ways(name, part, words, forth, back, *, alike=()):
    """A fault that alters commands and replies."""
    there = on_frames(name, part, words, forth, replies=False)
    again = on_frames(name, part, words, back)

    def put(side, fault):
        one, other = there.put(side, fault), again.put(side, fault)
        return Active(lambda: (one.begin(), other.begin()), one.clear)

    return LinkFault(name, FaultLayer.LINK, part, words, put, alike=alike, put=put)


def mirrored(opcode, words, severity, now):
    if opcode in (CTRL_POS, GET_POS):
        words[WIRE_ORDER.index(Channel.THUMB_ABDUCTION)] = 0xFFFF - words[WIRE_ORDER.index(Channel.THUMB_ABDUCTION)]
    return words


def rotate(opcode, words, severity, now):
    if opcode == CTRL_POS:
        words[3:7] = [words[4], words[5], words[6], words[3]]
    return words


def half_current(opcode, words, severity, now):
    if opcode != GET_CURR:
        return words
    return [round(severity * struct.unpack("<h", struct.pack("<H", word))[0]) for word in words]


def coarse_commands(opcode, words, severity, now):
    return [word - word % round(severity) for word in words] if opcode == CTRL_POS else words


def short_commands(opcode, words, severity, now):
    if opcode == CTRL_POS:
        words[WIRE_ORDER.index(Channel.MIDDLE)] = round(severity * words[WIRE_ORDER.index(Channel.MIDDLE)])
    return words


def on_bytes(name, part, words, make, severity=None, *, alike=(), layer=FaultLayer.LINK):
    """A fault that alters or delays the pieces that come from the hand; `make(fault, random)` returns what does it."""

    def put(side, fault):
        effect = LinkEffect(fault, passage=make(fault, side.random(fault)))
        return Active(lambda: side.link.add(effect), lambda: side.link.remove(fault))

    return LinkFault(name, layer, part, words, put, (), severity, alike=alike, put=put)


def newlines(_fault, _random):
    return lambda data, now: [(0.0, data.replace(b"\x0d", b"\x0a"))]


def hub_stalls(fault, _random):
    return lambda data, now: [(fault.severity - now % 4.0 if now % 4.0 < fault.severity else 0.0, data)]


def now_and_then_late(fault, _random):
    return lambda data, now: [(fault.severity / 1000.0 if now % 10.0 < 5.0 else 0.0, data)]


def slow_loop(fault, _random):
    period = fault.severity / 1000.0
    return lambda data, now: [(period - now % period, data)]


def clears_high_bits(_fault, random):
    def passage(data, now):
        return [
            (0.0, bytes(byte & 0x7F if at > 1 and random.random() < 0.03 else byte for at, byte in enumerate(data)))
        ]

    return passage


def clock_set(assembly, fault):
    """Hold the program up once for long, as a clock does to one that waits by it."""

    class Once:
        def random(self):
            if stall in assembly.stalls:
                assembly.stalls.remove(stall)
            return 0.0

    stall = fault, fault.severity, Once()
    return Active(
        lambda: assembly.stalls.append(stall), lambda: stall in assembly.stalls and assembly.stalls.remove(stall)
    )


def mixed_windows(assembly, fault):
    """Give three channels the ends of another version's windows, as a board that was reset half way has them."""
    shift = {at: round(fault.severity) for at in (0, 4, 6)}

    def move(sign):
        board = assembly.electronics.board
        for at, counts in shift.items():
            board.window.shift(at, sign * counts)

    return Active(lambda: move(1), lambda: move(-1))


def other_profile(**changes):
    """Return what puts a version on the board that is like the one declared, but for some of what it does."""

    def inject(assembly, fault):
        hand = assembly.electronics
        right = hand._profile

        def flash(profile):
            hand._profile = hand.board.profile = profile

        return Active(lambda: flash(replace(right, **changes)), lambda: flash(right))

    return inject


def restarts(assembly, fault):
    """Restart the board again and again, as a cable does that moves with the arm."""
    going = [False]

    def again():
        if going[0]:
            assembly.electronics.reset("reset")
            assembly.electronics.kernel.call_at(assembly.now() + fault.severity, again)

    def begin():
        going[0] = True
        assembly.electronics.kernel.call_at(assembly.now() + 0.2 * fault.severity, again)

    return Active(begin, lambda: going.__setitem__(0, False))


@dataclass
class NoisyBus:
    """Noise on the wire of all servos while motors draw current; a tap."""

    assembly: object
    fault: object
    random: object

    def asked(self, data):
        """Hear nothing."""

    def answered(self, data):
        """Damage some answers."""
        effort = float(np.abs(self.assembly.mechanics.efforts()).sum())
        if self.random.random() < self.fault.severity * min(effort / 1.0, 1.0):
            self.assembly.fire(self.fault)
            at = self.random.randrange(len(data)) if data else 0
            return data[:at] + bytes((data[at] ^ 0x5A,)) + data[at + 1 :] if data else data
        return data


def noisy_bus(assembly, fault):
    tap = NoisyBus(assembly, fault, assembly.random(fault))
    return Active(
        lambda: setattr(assembly.electronics.bus, "tap", tap), lambda: setattr(assembly.electronics.bus, "tap", None)
    )


def rubbing_neighbours(one, fault):
    joints = [joint for channel in (Channel.RING, Channel.PINKY) for joint in JOINTS[channel]]
    return with_values(one, "joint_friction", joints, lambda value: value + fault.severity)


def held(one, fault):
    joints = [joint for channel in DIGITS for joint in JOINTS[channel]]
    return with_values(one, "closed_stop", joints, lambda stop: stop * fault.severity)


def strong_supply(one, fault):
    return replace(one, hand=replace(one.hand, supply_ratio=one.hand.supply_ratio * (1.0 + fault.severity)))


MOTOR, ENCODER, SUPPLY, WINDING = FaultLayer.MOTOR, FaultLayer.ENCODER, FaultLayer.SUPPLY, FaultLayer.WINDING
# fmt: off
FAULTS = (
    unit("wrong_routing", CABLE, Part.DIGIT, "a cable runs past a guide: another lever, and it rubs",
        both(scaled("winding_scale", lambda fault: [fault.where], lambda by: 1.0 + by), added("cable_friction", lambda
        fault: [fault.where], lambda by: 5.0 * by)), FINGERS, Severity("of lever", (0.1, 0.2, 0.3))),
    unit("joint_play", JOINT, Part.DIGIT, "a joint has play: its stop is worn, its spring leans",
        both(added("closed_stop", middle_joint, math.radians), scaled("spring_open", middle_joint, lambda deg: 1.0 -
        deg / 36.0), scaled("spring_closed", middle_joint, lambda deg: 1.0 - deg / 36.0)), DIGITS, Severity("deg", (20,
        34, 36), 0, 36)),
    unit("spring_off_last", JOINT, Part.DIGIT, "the spring of the last phalanx is off", less_spring(last_joint),
        FINGERS, share("its torque", 0.6, 1.0, 1.0)),
    Fault("motor_fades", MOTOR, Part.SERVO, "a motor fades when it is warm", on_shaft(lambda assembly, fault:
        Fading(assembly.shafts, fault.where, fault.severity, 15.0)), ALL, share("torque when warm", 0.5, 0.8, 0.95)),
    in_registers("torque_left_low", "the torque of a servo was left low", lambda assembly, fault: {"max_torque":
        round(fault.severity), "torque_limit": round(fault.severity)}, Severity("0.1 %", (500, 300, 150), 0, 1000)),
    in_registers("angle_limit_left", "an angle limit was left in a servo", angle_limit, share("travel", 0.9, 0.6, 0.4),
        20.0),
    in_registers("other_gains", "a servo has the gains of another batch", lambda assembly, fault:
        {**dict.fromkeys(("position_p", "kp"), round(32 * fault.severity)), **dict.fromkeys(("position_d", "kd"), 0)},
        Severity("of the gain", (0.6, 0.35, 0.15))),
    in_registers("wide_dead_zone", "a servo's dead zone is wide", lambda assembly, fault: {"dead_zone_cw":
        round(fault.severity), "dead_zone_ccw": round(fault.severity)}, Severity("counts", (8, 16, 16), 0, 16)),
    in_registers("overload_quick", "a servo's overload protection was made quick", lambda assembly, fault:
        {"protection_current": 200, "over_current_time": round(fault.severity)}, Severity("10 ms", (60, 20, 5), 0,
        254)),
    Fault("gear_toothless", MOTOR, Part.SERVO, "gears have lost teeth", on_shaft(lambda assembly, fault:
        Toothless(assembly.shafts, fault.where, fault.severity)), ALL, Severity("rad", (0.1, 0.25, 0.5))),
    Fault("encoder_eccentric", ENCODER, Part.SERVO, "an encoder's magnet is beside its axis", on_shaft(lambda assembly,
        fault: Eccentric(assembly.shafts, fault.where, fault.severity)), ALL, Severity("rad", (0.03, 0.08, 0.15))),
    on_bytes("slow_loops", Part.BOARD, "the board's loop runs at another rate", slow_loop, Severity("ms", (10, 25,
        60)), alike=(Part.USB, Part.COMPUTER)),
    Fault("like_another_version", FaultLayer.BOARD, Part.BOARD, "the board has parts of another version",
        other_profile(acceleration=20, torque=350), alike=(Part.SETUP,)),
    both_ways("other_order", Part.BOARD, "the board has the fingers in another order", rotate, lambda opcode, words,
        severity, now: words, alike=(Part.DRIVER,)),
    both_ways("wrong_sign", Part.BOARD, "the firmware has the abduction with the other sign", mirrored, mirrored,
        alike=(Part.DRIVER, Part.SETUP)),
    on_bytes("hub_stalls", Part.USB, "a hub stalls now and then", hub_stalls, Severity("s", (0.05, 0.2, 0.6)),
        alike=(Part.COMPUTER,)),
    on_bytes("latency_on_and_off", Part.USB, "a hub is late for 5 s of every 10", now_and_then_late, Severity("ms", (4,
        16, 50)), alike=(Part.COMPUTER,)),
    on_bytes("newlines_turned", Part.COMPUTER, "the port turns 0d into 0a", newlines, alike=(Part.DRIVER, Part.USB)),
    on_bytes("bits_cleared", Part.USB, "high bits are lost now and then", clears_high_bits),
    Fault("clock_set", FaultLayer.HOST, Part.COMPUTER, "the computer's clock is set", clock_set, (), Severity("s",
        (0.3, 1.0, 3.0)), 25.0, alike=(Part.DRIVER,)),
    on_frames("current_scale", Part.BOARD, "currents are sent in another unit", half_current, Severity("factor", (0.7,
        0.5, 0.25)), alike=(Part.DRIVER,)),
    on_frames("coarse_commands", Part.DRIVER, "commands are rounded", coarse_commands, Severity("codes", (1024, 4096,
        16384)), replies=False, alike=(Part.BOARD,)),
    on_frames("short_commands", Part.DRIVER, "the map is wrong for one finger", short_commands, share("the way", 0.95,
        0.85, 0.6), replies=False, alike=(Part.BOARD,)),
    Fault("mixed_windows", FaultLayer.BOARD, Part.SETUP, "windows are mixed after a reset", mixed_windows, (),
        Severity("counts", (100, 250, 500)), 20.0, alike=(Part.BOARD,)),
    unit("glove", JOINT, Part.SETUP, "the hand wears a glove", both(added("cable_take_up", fingers, lambda mm: mm *
        0.001), added("joint_friction", finger_joints, lambda mm: 0.004 * mm)), (), Severity("mm", (3, 6, 10))),
    unit("bottle_held", JOINT, Part.SETUP, "the hand holds a bottle", held, (), share("travel", 0.8, 0.6, 0.4)),
    unit("neighbours_rub", JOINT, Part.SETUP, "ring and pinky touch", rubbing_neighbours, (), Severity("N m", (0.05,
        0.12, 0.2))),
    unit("spring_pops_off", JOINT, Part.DIGIT, "a finger's springs pop off", less_spring(lambda fault:
        JOINTS[fault.where]), FINGERS, share("their torque", 0.6, 0.9, 1.0), at_s=45.0),
    Fault("lead_opens", MOTOR, Part.BUS, "the thumb flexor's lead opens with the thumb across", on_shaft(lambda
        assembly, fault: Lead(assembly.shafts, fault.where, lambda: assembly.electronics)), (Channel.THUMB_FLEXOR,
        Channel.THUMB_CMC_FLEXION), alike=(Part.SERVO,)),
    Fault("bad_contact", SUPPLY, Part.SUPPLY, "the supply's plug has a bad contact", on_shaft(lambda assembly, fault:
        Contact(assembly.shafts, fault.severity, assembly)), (), share("the voltage", 0.3, 0.6, 0.85)),
    unit("strong_supply", SUPPLY, Part.SUPPLY, "the supply gives too much", strong_supply, (), Severity("of voltage",
        (0.15, 0.3, 0.5))),
    Fault("noisy_bus", FaultLayer.BUS, Part.BUS, "noise on the servos' wire while motors draw", noisy_bus, (),
        share("answers", 0.1, 0.3, 0.8), alike=(Part.BOARD, Part.SUPPLY)),
    Fault("cable_moves_out", FaultLayer.BOARD, Part.USB, "the board restarts again and again", restarts, (),
        Severity("s", (60, 30, 12)), alike=(Part.SUPPLY, Part.BOARD)),
    unit("thumb_tip_weak", JOINT, Part.DIGIT, "the thumb's tip joint is stiff", lambda one, fault: with_values(one,
        "joint_friction", [Joint.THUMB_IP], lambda value: value + fault.severity), (Channel.THUMB_FLEXOR,),
        Severity("N m", (0.02, 0.05, 0.12))),
    Fault("cable_slips", CABLE, Part.DIGIT, "a cable's knot slips a little at a time", slipping, FINGERS,
        Severity("mm", (4, 10, 20)), 1.0),
)
# fmt: on
"""Thirty-five faults."""
ON = (Channel.INDEX, Channel.PINKY, Channel.MIDDLE, Channel.RING, Channel.THUMB_FLEXOR, Channel.THUMB_CMC_FLEXION)


def _injection(number, fault):
    """Return a fault in its medium severity, or its severe one for every third, on channels in turn."""
    steps = fault.steps()
    fitting = [channel for channel in (*ON[number % len(ON) :], *ON) if channel in fault.channels]
    return fault.at(steps[-1] if number % 3 == 0 else steps[len(steps) // 2], fitting[0] if fitting else None)


FIRST = tuple(_injection(number, fault) for number, fault in enumerate(FAULTS))
"""Each once, to be played."""
