"""A third set of faults that no catalogue has, written after the rules had been mended by the first two.

Whoever writes rules of a diagnosis does not read this file. Made stronger after the first look, as a validation saw
nothing: springs_overwound, stop_breaks and skips, and knot_gives, which begins later since homing pulled at it first.
"""

from dataclasses import replace

import numpy as np

from aero.channels import CABLES, FINGERS, WIRE_ORDER, Channel, Joint
from figures.strangers.first import added, both, in_registers, on_frames, other_profile, scaled, unit, watching
from firmware_emulator.firmware.frames import FRAME, Opcode
from firmware_emulator.servo.models import REGISTERS
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.bus import SpoiledAnswers
from hil.emulated.faults.encoder import Encoder
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Severity, share
from hil.emulated.faults.link import LinkFault
from hil.emulated.faults.link_faults import LinkEffect
from hil.emulated.faults.mechanics import JOINTS, with_values
from hil.emulated.faults.motor import on_shaft
from hil.emulated.faults.servo import COOL_C, servo_of
from hil.verdict.part import Part

CABLE, JOINT, GEAR, BOARD = FaultLayer.CABLE, FaultLayer.JOINT, FaultLayer.GEAR, FaultLayer.BOARD
ENCODER, SUPPLY, BUS, SERVO = FaultLayer.ENCODER, FaultLayer.SUPPLY, FaultLayer.BUS, FaultLayer.SERVO
OPEN_HAND = FRAME.pack(Opcode.CTRL_POS, 0, *[0] * len(Channel))


def once(change, happens):
    """Break something for good as soon as a digit's servo pulls hard, and something is so."""

    def inject(assembly, fault):
        broken, done = assembly.changed(lambda one: change(one, fault)), []

        def look():
            hand = assembly.mechanics
            if not done and float(hand.efforts()[fault.where]) > 0.3 and happens(hand.joint_angles(), fault):
                done.append(broken.begin())

        return watching(assembly, 0.02, look, broken.clear)

    return inject


def in_posture(where, when):
    """Let a joint rub in some postures; whoever bends it through feels that, so that the unit has it always."""

    def inject(assembly, fault):
        rubs = assembly.changed(lambda one: added("joint_friction", where, lambda nm: nm)(one, fault))

        def look():
            compiled, joints = assembly.mechanics.compiled, assembly.unit.hand.joint_friction
            less = 0.0 if when(assembly.mechanics.joint_angles()) else fault.severity
            for joint in where(fault):
                compiled.model.dof_frictionloss[compiled.joint_dofs[joint]] = joints[joint] - less

        seen = watching(assembly, 0.01, look)
        return Active(lambda: (rubs.begin(), seen.begin()), lambda: (seen.clear(), rubs.clear()))

    return inject


def lets_go(assembly, fault):
    """Let a servo switch itself off when it has pulled for a time; the next goal switches it on."""
    pulled = [0.0]

    def look():
        pulled[0] += 0.05 if abs(float(assembly.mechanics.efforts()[fault.where])) > 0.1 else -pulled[0]
        if pulled[0] > fault.severity:
            pulled[0] = 0.0
            servo_of(assembly.electronics, fault.where).write(REGISTERS["torque_enable"].address, b"\0")

    return watching(assembly, 0.05, look)


def late(assembly, fault):
    """Let one servo act late on its goals."""
    servo = servo_of(assembly.electronics, fault.where)
    right = servo.parameters
    wrong = replace(right, goal_delay_s=right.goal_delay_s + 1e-3 * fault.severity)
    return Active(lambda: setattr(servo, "parameters", wrong), lambda: setattr(servo, "parameters", right))


class Skips:
    """An encoder that misses a share of the way when the shaft closes fast."""

    def __init__(self, lost):
        self._lost, self._error, self._last = lost, 0.0, (0.0, 0.0)

    def __call__(self, true, seconds):
        """Return what it reads."""
        way, span = true - self._last[0], seconds - self._last[1]
        if span > 0.0 and way > 5.0 * span:
            self._error -= self._lost * way
        self._last = true, seconds
        return true + self._error


def breaks_down(left, seconds, restarts):
    """Let the voltage break down for a while whenever the motors pull together."""

    def inject(assembly, fault):
        low = assembly.changed(
            lambda one: replace(one, hand=replace(one.hand, supply_ratio=left * one.hand.supply_ratio))
        )
        down, volts = [], assembly.healthy.servos.voltage

        def back():
            down.clear()
            low.clear()
            assembly.electronics.supply(volts)

        def look():
            if not down and float(np.abs(assembly.mechanics.efforts()).sum()) > fault.severity:
                down.append(True)
                low.begin()
                assembly.electronics.supply(left * volts)
                assembly.electronics.kernel.call_at(assembly.now() + seconds, back)
                for servo in assembly.electronics.servos if restarts else ():
                    servo.reboot()

        return watching(assembly, 0.02, look, back)

    return inject


def bad_pin(assembly, fault):
    """Lose the answers of a servo while its motor's current lifts its ground."""

    def spoil(answer, severity, _random):
        return b"" if abs(float(assembly.mechanics.efforts()[fault.where])) > severity else answer.data

    def begin():
        bus = assembly.electronics.bus
        bus.tap = bus.tap or SpoiledAnswers(assembly.electronics.kernel, assembly.fire)
        bus.tap.add(fault, spoil, assembly.random(fault))

    return Active(begin, lambda: assembly.electronics.bus.tap.remove(fault))


def deaf(assembly, fault):
    """Let all servos hear nothing for a moment of every 0.9 s."""

    def look():
        assembly.fire(fault)
        for servo in assembly.electronics.servos:
            servo.silent_until = max(servo.silent_until, assembly.now() + 1e-3 * fault.severity)

    return watching(assembly, 0.9, look)


def passing(name, part, words, make, severity=None, *, ways=("to_hand",), alike=(), at_s=0.0):
    """A fault of the pieces of a link; `make(fault, side)` returns what does it to one way."""

    def put(side, fault):
        effects = [LinkEffect(fault, way, make(fault, side)) for way in ways]
        return Active(lambda: [side.link.add(effect) for effect in effects], lambda: side.link.remove(fault))

    return LinkFault(name, FaultLayer.LINK, part, words, put, (), severity, at_s, alike=alike, put=put)


def unshielded(fault, side):
    """Damage replies while motors draw current."""
    random = side.random(fault)

    def passage(data, _now):
        pulled = min(float(np.abs(side.mechanics.efforts()).sum()), 1.0)
        at = random.randrange(len(data)) if random.random() < fault.severity * pulled else None
        return [(0.0, bytes(byte ^ 0x24 if place == at else byte for place, byte in enumerate(data)))]

    return passage


def smoothed(fault, _side):
    """Send a part of every step at once."""
    sent = []

    def passage(data, _now):
        if len(data) != FRAME.size or data[0] != Opcode.CTRL_POS:
            return [(0.0, data)]
        words = FRAME.unpack(data)[2:]
        sent[:] = [old + fault.severity * (word - old) for old, word in zip(sent or words, words, strict=True)]
        return [(0.0, FRAME.pack(Opcode.CTRL_POS, 0, *map(round, sent)))]

    return passage


def band(assembly, fault):
    """Pull two fingers together by what one is more bent than the other."""
    one, other = ([*JOINTS[channel][:2]] for channel in (Channel.MIDDLE, Channel.RING))

    def look():
        angles, torques = assembly.mechanics.joint_angles(), np.zeros(len(Joint))
        torques[one] = np.clip(fault.severity * (angles[other] - angles[one]), -0.3, 0.3)
        torques[other] = -torques[one]
        assembly.mechanics.push(torques)

    return watching(assembly, 0.005, look, lambda: assembly.mechanics.push(np.zeros(len(Joint))))


def cold(assembly, fault):
    """Let all gears drag (0.046 N m s/rad halve a free speed), and the servos be as cold as the room."""
    usual = assembly.healthy.servos.rest_temperature_c
    stiff = assembly.changed(
        lambda one: with_values(one, "spool_damping", list(Channel), lambda value: value + 0.046 * fault.severity)
    )

    def room(rest, now):
        for servo in assembly.electronics.servos:
            servo.parameters = replace(servo.parameters, rest_temperature_c=rest)
            servo.heat_to(now)

    return Active(lambda: (stiff.begin(), room(4.0, 4.0)), lambda: (stiff.clear(), room(usual, COOL_C)))


# fmt: off
FAULTS = (
    (Fault("knot_gives", CABLE, Part.DIGIT, "a knot gives as soon as it is pulled hard",
           once(added("cable_take_up", lambda fault: [fault.where], lambda mm: 1e-3 * mm), lambda *_: True),
           CABLES, Severity("mm", (4, 10, 18)), 60.0, alike=(Part.SETUP,)), Channel.RING),
    (Fault("burr", JOINT, Part.DIGIT, "a joint rubs where it is bent",
           in_posture(lambda fault: [JOINTS[fault.where][1]], lambda angles: angles[Joint.INDEX_PIP] > 0.7),
           (Channel.INDEX,), Severity("N m", (0.05, 0.1, 0.2)), 0.5), Channel.INDEX),
    (unit("springs_overwound", JOINT, Part.DIGIT, "springs were put in a turn too far",
          both(*(added(name, lambda at: JOINTS[at.where], lambda nm: nm) for name in ("spring_closed", "spring_open"))),
          CABLES, Severity("N m", (0.04, 0.1, 0.2))), Channel.PINKY),
    (unit("through_the_pivot", CABLE, Part.DIGIT, "the thumb's cable was led through the pivot of abduction",
          scaled("abduction_winding", lambda _: [1], lambda by: 1.0 - by), (Channel.THUMB_FLEXOR,),
          share("lever", 0.5, 0.8, 1.0)), Channel.THUMB_FLEXOR),
    (Fault("stop_breaks", JOINT, Part.DIGIT, "a stop breaks off when it is met with force",
           once(added("closed_stop", lambda fault: JOINTS[fault.where], np.radians),
                lambda angles, fault: angles[JOINTS[fault.where][0]] > 1.2),
           FINGERS, Severity("deg", (15, 35, 50)), 0.5), Channel.MIDDLE),
    (Fault("lead_in_the_way", JOINT, Part.DIGIT, "a lead is caught at the thumb's base when the thumb is across",
           in_posture(lambda fault: JOINTS[fault.where], lambda angles: angles[Joint.THUMB_ABDUCTION] > 0.6),
           (Channel.THUMB_CMC_FLEXION,), Severity("N m", (0.05, 0.12, 0.25)), 0.5), Channel.THUMB_CMC_FLEXION),
    (unit("glue", JOINT, Part.DIGIT, "glue has run into the joints",
          both(added("joint_damping", lambda fault: JOINTS[fault.where], lambda nms: nms),
               added("joint_friction", lambda fault: JOINTS[fault.where], lambda nms: 0.3 * nms)),
          FINGERS, Severity("N m s", (0.05, 0.15, 0.3))), Channel.INDEX),
    (in_registers("damping_left_high", "a servo's damping was left high",
                  lambda _, fault: dict.fromkeys(("position_d", "kd"), round(32 * fault.severity)),
                  Severity("times", (2.0, 4.0, 7.0), 0, 7.9)), Channel.THUMB_FLEXOR),
    (in_registers("warm_is_hot", "a servo's temperature limit was left low",
                  lambda _, fault: {"max_temperature": round(fault.severity)},
                  Severity("deg C", (42, 36, 30), 0, 100)), Channel.INDEX),
    (in_registers("second_id", "a servo also listens to the pinky's ID",
                  lambda *_: {"secondary_id": WIRE_ORDER.index(Channel.PINKY)}), Channel.MIDDLE),
    (in_registers("other_rate", "a servo's rate was set otherwise", lambda *_: {"baud": 1}), Channel.THUMB_ABDUCTION),
    (Fault("older_servo", SERVO, Part.SERVO, "one servo's own program acts late", late, ALL,
           Severity("ms", (20, 60, 150))), Channel.MIDDLE),
    (Fault("skips", ENCODER, Part.SERVO, "an encoder misses some of a fast closing",
           on_shaft(lambda assembly, fault: Encoder(assembly.shafts, fault.where, Skips(fault.severity))), ALL,
           share("the way", 0.006, 0.02, 0.05)), Channel.RING),
    (Fault("lets_go", SERVO, Part.SERVO, "a servo switches itself off when it has pulled for a time", lets_go, ALL,
           Severity("s", (3.0, 1.0, 0.3))), Channel.THUMB_CMC_FLEXION),
    (unit("heavy_rotor", GEAR, Part.SERVO, "a servo with another gear: a heavier rotor, more drag",
          both(scaled("rotor_inertia", lambda fault: [fault.where], lambda by: 1.0 + by),
               added("spool_damping", lambda fault: [fault.where], lambda by: 0.004 * by)),
          ALL, Severity("more inertia", (1.0, 3.0, 7.0))), Channel.PINKY),
    (on_frames("stuck_bit", Part.BOARD, "a bit of the positions is stuck",
               lambda code, words, bit, _: [word | round(bit) for word in words] if code == Opcode.GET_POS else words,
               Severity("bit", (512, 2048, 8192)), alike=(Part.DRIVER,)), None),
    (Fault("reads_seldom", BOARD, Part.BOARD, "the board reads its servos seldom",
           other_profile(telemetry_period_ms=90), alike=(Part.SETUP,)), None),
    (Fault("soon_hot", BOARD, Part.BOARD, "the board takes a warm servo for a hot one",
           other_profile(hot=(36, 250)), alike=(Part.SETUP,)), None),
    (on_frames("in_command_order", Part.DRIVER, "the driver takes currents in another order",
               lambda code, words, *_: [words[at] for at in WIRE_ORDER] if code == Opcode.GET_CURR else words,
               alike=(Part.BOARD,)), None),
    (passing("smoothed", Part.DRIVER, "the driver smooths what it sends", smoothed,
             share("the way at once", 0.6, 0.25, 0.1), alike=(Part.BOARD,)), None),
    (passing("second_program", Part.COMPUTER, "a second program opens the hand now and then",
             lambda fault, _: lambda data, now: [(0.0, data), (0.001, OPEN_HAND * (now % fault.severity < 0.02))],
             Severity("s", (8, 3, 1)), alike=(Part.DRIVER,)), None),
    (passing("seven_bits", Part.COMPUTER, "the port is set to seven bits while it is in use",
             lambda *_: lambda data, _: [(0.0, bytes(byte & 0x7F for byte in data))],
             ways=("to_hand", "from_hand"), alike=(Part.DRIVER,), at_s=30.0), None),
    (passing("in_beats", Part.COMPUTER, "what is sent leaves by a timer",
             lambda fault, _: lambda data, now: [(1e-3 * (fault.severity - 1e3 * now % fault.severity), data)],
             Severity("ms", (20, 60, 150)), alike=(Part.USB,)), None),
    (passing("unshielded", Part.USB, "the cable's shield is off: motors that work disturb it", unshielded,
             share("replies", 0.05, 0.3, 0.8), ways=("from_hand",)), None),
    (Fault("bad_pin", BUS, Part.BUS, "a plug has a bad ground pin: no answers while its motor works", bad_pin, ALL,
           Severity("N m", (0.4, 0.15, 0.08)), alike=(Part.SERVO,)), Channel.PINKY),
    (Fault("deaf", BUS, Part.BUS, "servos hear nothing for a moment", deaf, (), Severity("ms", (40, 120, 300)),
           alike=(Part.BOARD,)), None),
    (Fault("servos_restart", SUPPLY, Part.SUPPLY, "servos restart when they pull together",
           breaks_down(0.5, 0.2, True), (), Severity("N m", (3.0, 2.4, 1.8)), 0.5), None),
    (Fault("folds_back", SUPPLY, Part.SUPPLY, "the supply gives way for a second when it is loaded",
           breaks_down(0.6, 1.0, False), (), Severity("N m", (2.0, 1.0, 0.6)), 0.5), None),
    (Fault("band", JOINT, Part.SETUP, "a rubber band is round middle and ring finger", band, (),
           Severity("N m/rad", (0.05, 0.12, 0.25)), 0.5), None),
    (Fault("cold_room", GEAR, Part.SETUP, "the hand lies in the cold", cold, (),
           Severity("times the drag", (0.3, 1.0, 2.0)), 0.5), None),
)
# fmt: on
THIRD = tuple(
    fault.at(fault.steps()[-1] if fault.severity and i % 2 else None, channel)
    for i, (fault, channel) in enumerate(FAULTS)
)
"""Thirty injections, medium and severe by turns."""
