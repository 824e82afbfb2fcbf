"""A second set of faults that no catalogue has, written after the rules had been mended by the first.

Whoever writes rules of a diagnosis does not read this file.
"""

import math

from aero.channels import FINGERS, WIRE_ORDER, Channel
from figures.strangers.first import (
    CTRL_POS,
    GET_CURR,
    GET_POS,
    Contact,
    added,
    both,
    in_registers,
    last_joint,
    on_bytes,
    on_frames,
    other_profile,
    scaled,
    unit,
)
from firmware_emulator.plant import Drive
from hil.faults.assembly import Active
from hil.faults.fault import ALL, Fault, FaultLayer, Part, Severity, share
from hil.faults.mechanics import JOINTS
from hil.faults.motor import on_shaft, weaker
from hil.faults.shaft_fault import ShaftFault

CABLE, JOINT, MOTOR = FaultLayer.CABLE, FaultLayer.JOINT, FaultLayer.MOTOR
ENCODER, SUPPLY, BUS = FaultLayer.ENCODER, FaultLayer.SUPPLY, FaultLayer.BUS
INDEX_AND_MIDDLE = [joint for channel in (Channel.INDEX, Channel.MIDDLE) for joint in JOINTS[channel]]
RING_AND_PINKY = [joint for channel in (Channel.RING, Channel.PINKY) for joint in JOINTS[channel]]


class OneWay(ShaftFault):
    """A motor that is weak in one direction: half of its bridge is gone."""

    def __init__(self, behind, shaft, lost, sign):
        super().__init__(behind, shaft)
        self._lost, self._sign, self._weak = lost, sign, False

    def advance_to(self, t):
        super().advance_to(t)
        weak = self.active and self._sign * float(self.behind.efforts()[self.shaft]) > 0.0
        if weak != self._weak:
            self._weak = weak
            self.renew()

    def changed(self, drive):
        return weaker(drive, self._lost) if self._weak else drive


class CutsOut(ShaftFault):
    """A motor that cuts out for good after it has worked for a time."""

    def __init__(self, behind, shaft, seconds):
        super().__init__(behind, shaft)
        self._left, self._out = seconds, False

    def advance_to(self, t):
        span = t - self.time
        super().advance_to(t)
        if self.active and abs(float(self.behind.efforts()[self.shaft])) > 0.02:
            self._left -= span
        if self.active and not self._out and self._left < 0.0:
            self._out = True
            self.renew()

    def changed(self, drive):
        return Drive(powered=False) if self._out else drive


class WornSpot(ShaftFault):
    """An encoder that jumps over one spot of its turn."""

    def __init__(self, behind, shaft, jump):
        super().__init__(behind, shaft)
        self._jump = jump

    def angles(self):
        angles = self.behind.angles()
        if self.active and 1.0 < float(angles[self.shaft]) % math.tau < 1.6:
            angles[self.shaft] += self._jump
        return angles


class Battery(Contact):
    """A supply that is empty after a while: its voltage goes down and stays there."""

    def advance_to(self, t):
        ShaftFault.advance_to(self, t)
        bad = self.active and self._assembly.is_running and self.time > 30.0
        if bad != self._bad:
            self._bad = bad
            if self.active:
                self._assembly.hand.supply(6.0 * self.supply_left)
            self.renew()


class ThinWire(Contact):
    """A wire that feeds the four fingers alone and is thin."""

    def drive(self, shaft, drive):
        self._all[shaft] = drive
        self.behind.drive(shaft, weaker(drive, self._lost) if self._bad and shaft in FINGERS else drive)

    def advance_to(self, t):
        ShaftFault.advance_to(self, t)
        bad = self.active and self._assembly.is_running
        if bad != self._bad:
            self._bad = bad
            self.renew()


class LooseChain:
    """A plug in the chain of servos that opens now and then: those behind it do not answer; a tap."""

    def __init__(self, assembly, servos, seconds):
        self._assembly, self._servos, self._seconds = assembly, servos, seconds

    def asked(self, data):
        """Hear nothing."""

    def answered(self, data):
        """Lose the answers of the servos behind the plug, for a while of every six seconds."""
        if self._assembly.now() % 6.0 > self._seconds:
            return data
        out, at = b"", 0
        while at + 4 <= len(data):
            size = data[at + 3] + 4
            out += b"" if data[at + 2] in self._servos else data[at : at + size]
            at += size
        return out


def loose_chain(assembly, fault):
    tap = LooseChain(assembly, set(range(3, 7)), fault.severity)
    return Active(lambda: setattr(assembly.hand.bus, "tap", tap), lambda: setattr(assembly.hand.bus, "tap", None))


def frays(assembly, fault):
    """Let a cable rub more and more, in five steps of eight seconds."""
    there = []

    def more(step):
        for active in there:
            active.clear()
        rubs = added("cable_friction", lambda fault: [fault.where], lambda by: 0.2 * step * by)
        there[:] = [assembly.changed(lambda one: rubs(one, fault))]
        there[0].begin()
        if step < 5:
            assembly.hand.kernel.call_at(assembly.now() + 8.0, lambda: there and more(step + 1))

    def clear():
        for active in there:
            active.clear()
        there.clear()

    return Active(lambda: more(1), clear)


def at(channel):
    return WIRE_ORDER.index(channel)


def short_replies(opcode, words, severity, now):
    return [round(severity * word) for word in words] if opcode == GET_POS else words


def thumb_exchanged(opcode, words, severity, now):
    if opcode in (GET_POS, GET_CURR):
        one, other = at(Channel.THUMB_CMC_FLEXION), at(Channel.THUMB_FLEXOR)
        words[one], words[other] = words[other], words[one]
    return words


def displaced(opcode, words, severity, now):
    if opcode == CTRL_POS:
        words[at(Channel.RING)] = min(words[at(Channel.RING)] + round(severity), 0xFFFF)
    return words


def fingers_exchanged(opcode, words, severity, now):
    if opcode == CTRL_POS:
        one, other = at(Channel.INDEX), at(Channel.MIDDLE)
        words[one], words[other] = words[other], words[one]
    return words


def flow_control(_fault, _random):
    return lambda data, now: [(0.0, data.replace(b"\x13", b"").replace(b"\x11", b""))]


def two_pieces(fault, _random):
    return lambda data, now: [(0.0, data[:8]), (fault.severity / 1000.0, data[8:])]


def drops_out(fault, _random):
    return lambda data, now: [] if now % 12.0 < fault.severity else [(0.0, data)]


def collector(fault, _random):
    """Hold up what comes in every third second, as a program does that cleans up its memory."""
    return lambda data, now: [(fault.severity if now % 3.0 < 0.02 else 0.0, data)]


def half_deaf(fault, random):
    return lambda data, now: [] if random.random() < fault.severity else [(0.0, data)]


# fmt: off
FAULTS = (
    unit("cable_crossed", CABLE, Part.DIGIT, "a cable is wound over itself on its spool",
         scaled("winding_scale", lambda fault: [fault.where], lambda by: 1.0 - by), FINGERS,
         Severity("of lever", (0.1, 0.2, 0.3))),
    unit("tip_stuck", JOINT, Part.DIGIT, "the last joint is stuck",
         added("joint_friction", last_joint, lambda nm: nm), FINGERS, Severity("N m", (0.05, 0.2, 1.0))),
    unit("rubber_band", JOINT, Part.DIGIT, "a rubber band is round one finger",
         both(scaled("spring_closed", last_joint, lambda by: 1.0 + by),
         scaled("spring_open", last_joint, lambda by: 1.0 + by)), FINGERS, Severity("times", (0.5, 1.5, 3.0))),
    unit("grit_in_stop", JOINT, Part.DIGIT, "grit lies in the stop of the thumb's base",
         scaled("closed_stop", lambda fault: JOINTS[fault.where], lambda by: 1.0 - by),
         (Channel.THUMB_CMC_FLEXION, Channel.THUMB_ABDUCTION), share("travel", 0.1, 0.2, 0.4)),
    Fault("cable_frays", CABLE, Part.DIGIT, "a cable frays and rubs more and more", frays,
         (*FINGERS, Channel.THUMB_FLEXOR), Severity("N", (2.0, 5.0, 10.0)), 1.0),
    unit("thumb_base_rubs", JOINT, Part.DIGIT, "the thumb's abduction rubs",
         added("joint_friction", lambda fault: JOINTS[fault.where], lambda nm: nm), (Channel.THUMB_ABDUCTION,),
         Severity("N m", (0.05, 0.1, 0.2))),
    Fault("half_bridge", MOTOR, Part.SERVO, "a motor is weak in closing",
         on_shaft(lambda assembly, fault: OneWay(assembly.shafts, fault.where, fault.severity, 1.0)), ALL,
         share("torque", 0.4, 0.7, 0.95)),
    Fault("cuts_out", MOTOR, Part.SERVO, "a motor cuts out when it has worked for a while",
         on_shaft(lambda assembly, fault: CutsOut(assembly.shafts, fault.where, fault.severity)), ALL,
         Severity("s", (40.0, 20.0, 8.0))),
    Fault("worn_spot", ENCODER, Part.SERVO, "an encoder jumps at one spot",
         on_shaft(lambda assembly, fault: WornSpot(assembly.shafts, fault.where, fault.severity)), ALL,
         Severity("rad", (0.03, 0.1, 0.3))),
    in_registers("torque_left_on_thumb", "the torque of a thumb servo was left low",
         lambda assembly, fault: {"max_torque": round(fault.severity), "torque_limit": round(fault.severity)},
         Severity("0.1 %", (500, 350, 200), 0, 1000)),
    in_registers("start_force", "a servo's least force is large",
         lambda assembly, fault: {"min_start_force": round(fault.severity)}, Severity("0.1 %", (40, 100, 200), 0, 254)),
    in_registers("gain_too_high", "a servo's gain is another's",
         lambda assembly, fault: dict.fromkeys(("position_p", "kp"), round(32 * fault.severity)),
         Severity("times", (2.0, 3.5, 6.0))),
    Fault("loose_chain", BUS, Part.BUS, "a plug in the chain of servos opens now and then", loose_chain, (),
         Severity("s", (0.1, 0.4, 1.0))),
    on_frames("short_replies", Part.BOARD, "positions are told too small", short_replies,
         share("them", 0.97, 0.92, 0.85), alike=(Part.DRIVER,)),
    on_frames("thumb_exchanged", Part.BOARD, "two channels of the thumb are exchanged in replies", thumb_exchanged,
         alike=(Part.DRIVER,)),
    Fault("weak_version", FaultLayer.BOARD, Part.BOARD, "the board asks all servos for little torque",
         other_profile(torque=300), alike=(Part.SETUP,)),
    on_frames("ring_displaced", Part.DRIVER, "the map displaces the ring finger", displaced,
         Severity("codes", (2000, 6000, 12000)), replies=False, alike=(Part.BOARD,)),
    on_frames("fingers_exchanged", Part.DRIVER, "the driver sends two fingers in exchanged places",
         fingers_exchanged, replies=False, alike=(Part.BOARD,)),
    on_bytes("flow_control", Part.COMPUTER, "the port's software flow control is on", flow_control,
         alike=(Part.DRIVER, Part.USB)),
    on_bytes("two_pieces", Part.USB, "a hub passes eight bytes at a time", two_pieces, Severity("ms", (4, 15, 40)),
         alike=(Part.COMPUTER,)),
    on_bytes("drops_out", Part.USB, "the link drops out now and then", drops_out, Severity("s", (0.1, 0.3, 0.6)),
         alike=(Part.COMPUTER,)),
    on_bytes("collector", Part.COMPUTER, "the program stands still now and then", collector,
         Severity("s", (0.05, 0.15, 0.4)), alike=(Part.USB,)),
    on_bytes("half_deaf", Part.USB, "some replies never come", half_deaf, share("replies", 0.01, 0.05, 0.2),
         alike=(Part.COMPUTER,)),
    unit("tape", JOINT, Part.SETUP, "tape is round index and middle finger",
         added("joint_friction", lambda _: INDEX_AND_MIDDLE, lambda nm: nm), (),
         Severity("N m", (0.04, 0.08, 0.15))),
    unit("something_in_the_palm", JOINT, Part.SETUP, "something lies in the palm under ring and pinky",
         scaled("closed_stop", lambda _: RING_AND_PINKY, lambda by: 1.0 - by), (), share("travel", 0.1, 0.25, 0.5)),
    unit("sleeve", CABLE, Part.SETUP, "a sleeve presses on all cables",
         added("cable_friction", lambda _: list(FINGERS), lambda by: by), (), Severity("N", (2.0, 5.0, 8.0))),
    Fault("battery_empty", SUPPLY, Part.SUPPLY, "the battery is empty after half a minute",
         on_shaft(lambda assembly, fault: Battery(assembly.shafts, fault.severity, assembly)), (),
         share("the voltage", 0.2, 0.4, 0.6)),
    Fault("thin_wire", SUPPLY, Part.SUPPLY, "the wire to the fingers' servos is thin",
         on_shaft(lambda assembly, fault: ThinWire(assembly.shafts, fault.severity, assembly)), (),
         share("the torque", 0.3, 0.5, 0.7), alike=(Part.BUS,)),
)
# fmt: on
BY_NAME = {fault.name: fault for fault in FAULTS}
WHERE = (
    ("cable_crossed", Channel.RING),
    ("tip_stuck", Channel.INDEX),
    ("rubber_band", Channel.PINKY),
    ("grit_in_stop", Channel.THUMB_CMC_FLEXION),
    ("cable_frays", Channel.MIDDLE),
    ("thumb_base_rubs", Channel.THUMB_ABDUCTION),
    ("half_bridge", Channel.INDEX),
    ("cuts_out", Channel.THUMB_FLEXOR),
    ("worn_spot", Channel.MIDDLE),
    ("torque_left_on_thumb", Channel.THUMB_CMC_FLEXION),
    ("start_force", Channel.RING),
    ("gain_too_high", Channel.PINKY),
    ("loose_chain", None),
    ("short_replies", None),
    ("thumb_exchanged", None),
    ("weak_version", None),
    ("ring_displaced", None),
    ("fingers_exchanged", None),
    ("flow_control", None),
    ("two_pieces", None),
    ("drops_out", None),
    ("collector", None),
    ("half_deaf", None),
    ("tape", None),
    ("something_in_the_palm", None),
    ("sleeve", None),
    ("battery_empty", None),
    ("thin_wire", None),
    ("half_bridge", Channel.THUMB_CMC_FLEXION),
    ("cable_frays", Channel.THUMB_FLEXOR),
)
SECOND = tuple(
    BY_NAME[name].at(BY_NAME[name].steps()[-1] if BY_NAME[name].severity and i % 2 else None, channel)
    for i, (name, channel) in enumerate(WHERE)
)
"""Thirty injections, medium and severe by turns."""
