"""A sixth set of faults that no catalogue has, as an owner meets them in a year.

Written without a look at the rules of the diagnosis, its steps, its pages, the catalogue's judging or a stored result;
whoever writes rules of a diagnosis does not read this file. Above each fault stands the truth: the broken thing, a
person's finding by bending and looking, and the mend.
"""

import math
from dataclasses import replace

from aero.channels import CABLES, FINGERS, JOINT_BOX_RAD, WIRE_ORDER, Channel
from figures.strangers.fifth import Looking, Wire, in_memory, linked, passing, rewritten, wire
from figures.strangers.first import watching
from figures.strangers.fourth import told
from firmware_emulator.firmware.frames import FRAME, FRAME_SIZE, Opcode
from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.encoder import Encoder
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Severity, share
from hil.emulated.faults.link_faults import LinkEffect
from hil.emulated.faults.mechanics import JOINTS, another_unit, with_values
from hil.emulated.faults.motor import UNPOWERED, Motor, on_shaft
from hil.emulated.faults.servo import servo_of
from hil.verdict.part import Part
from model.geometry.winding import SPOOL_RADIUS
from model.softness import constraint

CABLE, JOINT, WINDING, MOTOR = FaultLayer.CABLE, FaultLayer.JOINT, FaultLayer.WINDING, FaultLayer.MOTOR
ENCODER, SUPPLY, SERVO, BUS = FaultLayer.ENCODER, FaultLayer.SUPPLY, FaultLayer.SERVO, FaultLayer.BUS
BOARD = FaultLayer.BOARD
SIGNED = (Opcode.GET_VEL, Opcode.GET_CURR)
FLOW_CONTROL = bytes((0x11, 0x13))
"""XON and XOFF."""
HEAT_C = 95.0
"""Reading of a thermistor whose contact opens, °C."""


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


class Grain(Mechanical):
    """Gears with dry friction in one sector of the shaft's turn."""

    LOW_RAD, HIGH_RAD = 1.0, 1.5

    def look(self):
        self.rub(self.severity if self.LOW_RAD < self.angle < self.HIGH_RAD else 0.0)

    def end(self):
        super().end()
        self.rub(0.0)


class Pinched(Mechanical):
    """A finger's cable that the base of the abducted thumb squeezes."""

    def look(self):
        abducted = float(self.assembly.mechanics.state().angles[Channel.THUMB_ABDUCTION]) > 0.8
        self.rub(SPOOL_RADIUS * self.severity if abducted else 0.0)

    def end(self):
        super().end()
        self.rub(0.0)


class PilesUp(Mechanical):
    """A cable that climbs on its own turns: the spool grows beyond an angle."""

    CLIMBS_RAD = 1.5

    def look(self):
        self.lengthen(-self.severity * SPOOL_RADIUS * max(self.angle - self.CLIMBS_RAD, 0.0))

    def end(self):
        super().end()
        self.lengthen(0.0)


class FallsBeside(Mechanical):
    """A cable that falls off its guide at a fast opening, and is pulled back by a strong tension."""

    FAST_RAD_S, PULLS_N = -5.0, 25.0

    def __init__(self, assembly, fault):
        super().__init__(assembly, fault)
        self._longer_m = 0.0

    def look(self):
        if self.tension > self.PULLS_N:
            self._longer_m = 0.0
        elif float(self.assembly.mechanics.state().speeds[self.shaft]) < self.FAST_RAD_S:
            self._longer_m = 1e-3 * self.severity
        self.lengthen(self._longer_m)

    def end(self):
        super().end()
        self.lengthen(0.0)


class Yielding(Mechanical):
    """A cable that is softer than the others."""

    def look(self):
        self.soften(1e-3 * self.severity / 30.0)

    def end(self):
        super().end()
        self.soften(0.0)

    def soften(self, more):
        """Add a compliance to the cable, m/N."""
        model, unit = self.compiled.model, self.compiled.parameters
        cable = self.compiled._cables[CABLES.index(self.shaft)]
        compliance = unit.cable_compliance + more
        reference, impedance = constraint(compliance, float(model.tendon_invweight0[cable]), unit.timestep)
        model.tendon_solref_lim[cable], model.tendon_solimp_lim[cable] = reference, impedance


class OneWay(Looking):
    """A motor whose bridge drives it in the closing direction only."""

    def __init__(self, behind, shaft):
        super().__init__(behind, shaft)
        self._opens = False

    def look(self):
        angle, speed = (float(values[self.shaft]) for values in (self.behind.angles(), self.behind.speeds()))
        if (opens := self.asked.effort(self.asked.setpoint, angle, speed) < 0.0) != self._opens:
            self._opens = opens
            self.renew()

    def changed(self, drive):
        return UNPOWERED if self._opens else drive


class DryBrushes(Looking):
    """A motor that has no current for some time at the first pull after a rest."""

    RESTS_NM, RESTS_S, PULLS_NM = 0.06, 0.6, 0.1

    def __init__(self, behind, shaft, late_s):
        super().__init__(behind, shaft)
        self._late_s, self._open, self._since = late_s, False, None

    def look(self):
        angle, speed = (float(values[self.shaft]) for values in (self.behind.angles(), self.behind.speeds()))
        effort = abs(self.asked.effort(self.asked.setpoint, angle, speed))
        waits = effort > self.PULLS_NM if self._open else effort < self.RESTS_NM and abs(speed) < 0.1
        self._since = (self.time if self._since is None else self._since) if waits else None
        if waits and self.time - self._since >= (self._late_s if self._open else self.RESTS_S):
            self._open, self._since = not self._open, None
            self.renew()

    def changed(self, drive):
        return UNPOWERED if self._open else drive


def flat(assembly, fault):
    """A battery near its end: less voltage from the start, and less by the minute."""
    full, since = 7.0 * assembly.healthy.servos.stall_torque, []

    def lost(effort, t):
        since[:] = since or [t]
        return min(0.12 + fault.severity * (t - since[0]) / 60.0 + 0.25 * effort / full, 0.5)

    return lost


def slow_to_rise(assembly, fault):
    """An adapter that follows a rise of the load only after some tenths of a second."""
    full, last = 7.0 * assembly.healthy.servos.stall_torque, [None, 0.0]

    def lost(effort, t):
        seconds = 0.0 if last[0] is None else t - last[0]
        last[:] = t, last[1] + (effort - last[1]) * min(seconds / 0.4, 1.0)
        return min(fault.severity * max(effort - last[1], 0.0) / full, 0.6)

    return lost


def power_bank(assembly, fault):
    """All servos lose their power for 1.5 s after a rest of the motors."""
    rested = [0.0]

    def look():
        works = float(abs(assembly.mechanics.efforts()).sum()) > 0.4
        rested[0] = 0.0 if works else rested[0] + 0.1
        if rested[0] > fault.severity:
            rested[0] = 0.0
            for servo in assembly.electronics.servos:
                servo.reboot()
                servo.silent_until = assembly.now() + 1.5

    return watching(assembly, 0.1, look)


def burnt(assembly, fault):
    full = assembly.healthy.servos.stall_torque
    return Wire(assembly, [fault.where], lambda effort, _: min(fault.severity * effort / full, 0.8), is_plug=False)


def restarts_at_speed(assembly, fault):
    """A servo restarts, at random, while its shaft turns fast."""
    random = assembly.random(fault)

    def look():
        fast = abs(float(assembly.mechanics.state().speeds[fault.where])) > 2.0
        if fast and random.random() < 0.02 * fault.severity:
            assembly.fire(fault)
            servo_of(assembly.electronics, fault.where).reboot()

    return watching(assembly, 0.02, look)


def open_thermistor(assembly, fault):
    """A servo takes itself for hot for 0.3 s, again and again."""
    servo, right, left_s = servo_of(assembly.electronics, fault.where), [], [0.5 * fault.severity]

    def look():
        left_s[0] -= 0.1
        if right and left_s[0] <= 0.0:
            cool()
            left_s[0] = fault.severity
        elif left_s[0] <= 0.0:
            right.append(servo._heat)
            servo.heat_to(HEAT_C)
            left_s[0] = 0.3

    def cool():
        while right:
            servo._heat = right.pop()
            servo.feedback.temperature_c = sum(servo._heat)

    return watching(assembly, 0.1, look, cool)


def shaken(side, fault):
    """A link that loses pieces while the hand moves fast."""
    random = side.random(fault)

    def passed(data, now):
        shakes = float(abs(side.mechanics.speeds()).sum()) > 4.0
        return [] if shakes and random.random() < fault.severity else [(0.0, data)]

    return passed


def without_flow_control(_side, _fault):
    return lambda data, now: [(0.0, data.translate(None, FLOW_CONTROL))]


def gentle_tool(side, fault):
    """Another program sets a low torque of all channels every 2 s, and reads its own acknowledgements."""
    last, torque = [-math.inf], round(fault.severity)
    frames = [FRAME.pack(Opcode.SET_TOR, 0, channel, torque, *[0] * 5) for channel in range(len(Channel))]
    unread = []

    def sent(data, now):
        if now - last[0] < 2.0:
            return [(0.0, data)]
        last[0] = now
        unread.extend(frames)
        return [(0.0, data), *((0.0005, frame) for frame in frames)]

    def answered(data, now):
        if data in unread:
            unread.remove(data)
            return []
        return [(0.0, data)]

    def clear():
        side.link.remove(fault)
        board = side.electronics.board
        for at, left in enumerate(board.torque):
            if left == torque:
                board.torque[at] = board.profile.torque

    def begin():
        side.link.add(LinkEffect(fault, "to_hand", sent))
        side.link.add(LinkEffect(fault, "from_hand", answered))

    return Active(begin, clear)


def coupled(words, factor):
    """The flexor's goal follows that of abduction."""
    abduction, flexor = WIRE_ORDER.index(Channel.THUMB_ABDUCTION), WIRE_ORDER.index(Channel.THUMB_FLEXOR)
    words[flexor] = min(max(round(words[flexor] + factor * words[abduction]), 0), 0xFFFF)
    return words


def averaging(assembly, fault):
    """A firmware that sends running averages of its readings."""
    known = {}

    def averaged(data, now):
        if len(data) != FRAME_SIZE or data[0] not in (Opcode.GET_POS, *SIGNED):
            return [(0.0, data)]
        opcode, filler, *words = FRAME.unpack(data)
        if opcode in SIGNED:
            words = [word - 0x10000 * (word > 0x7FFF) for word in words]
        before, old = known.get(opcode, (now, words))
        new = 1.0 - math.exp((before - now) / fault.severity)
        means = [mean + new * (word - mean) for mean, word in zip(old, words, strict=True)]
        known[opcode] = now, means
        return [(0.0, FRAME.pack(opcode, filler, *(round(mean) & 0xFFFF for mean in means)))]

    return Active(
        lambda: assembly.link.add(LinkEffect(fault, "from_hand", averaged)), lambda: assembly.link.remove(fault)
    )


def left_torque(assembly, fault):
    """Another program's SET_TOR, in the board's memory up to its next restart."""
    at, board = WIRE_ORDER.index(fault.where), assembly.electronics.board
    right = board.torque[at]
    return Active(
        lambda: board.torque.__setitem__(at, round(fault.severity)), lambda: board.torque.__setitem__(at, right)
    )


def jumping_spring(assembly, fault):
    """A middle joint whose spring is off its seat beyond 40 deg of bending."""
    joint = JOINTS[fault.where][1]
    off = assembly.changed(
        lambda unit: with_values(
            with_values(unit, "spring_open", [joint], lambda _: 0.0), "spring_closed", [joint], lambda _: 0.0
        )
    )

    def look():
        unit, compiled = assembly.healthy.hand, assembly.mechanics.compiled
        opened, closed = unit.spring_open[joint], unit.spring_closed[joint]
        rate = (closed - opened) / JOINT_BOX_RAD[joint, 1]
        number = compiled.model.joint(joint.label).id
        seated = float(assembly.mechanics.joint_angles()[joint]) < math.radians(40.0)
        compiled.model.jnt_stiffness[number] = rate if seated else 0.0
        compiled.model.qpos_spring[compiled.joint_qpos[joint]] = -opened / rate if seated else 0.0

    seen = watching(assembly, 0.004, look)
    return Active(lambda: (off.begin(), seen.begin()), lambda: (seen.clear(), off.clear()))


def friction_of(assembly, fault, torque):
    """Set the dry friction added to the joints of a digit, N m."""
    compiled = assembly.mechanics.compiled
    for joint in JOINTS[fault.where]:
        compiled.model.dof_frictionloss[compiled.joint_dofs[joint]] = (
            assembly.healthy.hand.joint_friction[joint] + torque
        )


def grit(assembly, fault):
    """Joints that rub, at every reversal by another amount."""
    random, way, torque = assembly.random(fault), [0.0], [fault.severity]
    rubs = assembly.changed(
        lambda unit: with_values(unit, "joint_friction", JOINTS[fault.where], lambda was: was + 0.5 * fault.severity)
    )

    def look():
        speed = float(assembly.mechanics.state().speeds[fault.where])
        if abs(speed) > 0.3 and speed * way[0] <= 0.0:
            way[0], torque[0] = speed, random.uniform(0.1, 1.0) * fault.severity
        friction_of(assembly, fault, torque[0])

    seen = watching(assembly, 0.01, look)
    return Active(lambda: (rubs.begin(), seen.begin()), lambda: (seen.clear(), rubs.clear()))


def tacky(assembly, fault):
    """A closed finger that sticks to the palm, and peels off some time after its cable let it go."""
    first, let_go = JOINTS[fault.where][0], []
    sticks = [False]

    def look():
        angle = float(assembly.mechanics.joint_angles()[first])
        tension = float(assembly.mechanics.glimpse().tensions[fault.where])
        if angle > 1.2 and tension > 5.0:
            sticks[0] = True
            let_go.clear()
        elif sticks[0] and tension < 2.0:
            let_go[:] = let_go or [assembly.now()]
            sticks[0] = assembly.now() - let_go[0] < fault.severity
        friction_of(assembly, fault, 0.4 if sticks[0] else 0.0)

    return watching(assembly, 0.01, look, lambda: friction_of(assembly, fault, 0.0))


def lying(unit, fault):
    unit = with_values(unit, "closed_stop", JOINTS[Channel.THUMB_ABDUCTION], lambda stop: stop * fault.severity)
    return with_values(unit, "joint_friction", JOINTS[Channel.THUMB_CMC_FLEXION], lambda was: was + 0.08)


# The computer, its programs, the link.
FLOW_CONTROLLED = linked(
    # Truth: the port's settings have XON/XOFF flow control. Hand: nothing. Mend: the port opened raw.
    "flow_control",
    Part.COMPUTER,
    "the port swallows the bytes 11 and 13",
    passing("from_hand", without_flow_control),
)
GENTLE_TOOL = linked(
    # Truth: a forgotten tool sets a low torque every 2 s. Hand: nothing. Mend: end the tool, restart the board.
    "gentle_tool",
    Part.COMPUTER,
    "another program lowers the torque of all channels again and again",
    gentle_tool,
    Severity("6.5 mA", (400.0, 200.0, 100.0), 0.0, 1023.0),
)
HALF_WORDS = linked(
    # Truth: a driver of one's own packs signed words. Hand: nothing. Mend: the format in the driver.
    "half_words",
    Part.DRIVER,
    "goals end at half of the travel",
    passing("to_hand", rewritten(lambda words, most: [min(word, round(most)) for word in words])),
    Severity("of 65535", (57343.0, 49151.0, 32767.0), 0.0, 65535.0),
)
OWN_COUPLING = linked(
    # Truth: a driver of one's own adds the abduction's cable once too often. Hand: nothing. Mend: the driver's term.
    "own_coupling",
    Part.DRIVER,
    "the flexor's goal follows that of the thumb's abduction",
    passing("to_hand", rewritten(coupled)),
    share("the abduction's goal", 0.05, 0.15, 0.4),
)
SHAKEN_PLUG = Fault(
    # Truth: a worn USB socket opens when the hand shakes. Hand: the plug is loose. Mend: another cable.
    "shaken_plug",
    FaultLayer.LINK,
    Part.USB,
    "answers get lost while the hand moves fast",
    passing("from_hand", shaken),
    severity=share("answers lost", 0.1, 0.4, 0.9),
)

# Supply and plugs.
FLAT_BATTERY = Fault(
    # Truth: the battery is nearly empty. Hand: nothing; little voltage at the plug. Mend: a charged battery.
    "flat_battery",
    SUPPLY,
    Part.SUPPLY,
    "the voltage is low, and falls from minute to minute",
    wire(tuple(ALL), flat, is_plug=True),
    severity=share("the voltage a minute", 0.02, 0.08, 0.2),
)
SLOW_ADAPTER = Fault(
    # Truth: the adapter's capacitor is dry. Hand: nothing; the voltage at rest is right. Mend: the adapter.
    "slow_adapter",
    SUPPLY,
    Part.SUPPLY,
    "the voltage breaks down for a moment when motors start together",
    wire(tuple(ALL), slow_to_rise, is_plug=True),
    severity=share("the voltage when all motors start", 0.2, 0.4, 0.6),
)
POWER_BANK = Fault(
    # Truth: the power bank switches off when little is drawn. Hand: nothing. Mend: a supply without such a circuit.
    "power_bank",
    SUPPLY,
    Part.SUPPLY,
    "the servos have no power for 1.5 s after a rest",
    power_bank,
    severity=Severity("s of rest", (30.0, 12.0, 5.0), 0.5, 600.0),
    at_s=0.5,
)
BURNT_PIN = Fault(
    # Truth: the power pin of a servo's plug is burnt. Hand: a brown plug. Mend: the plug.
    "burnt_pin",
    SUPPLY,
    Part.BUS,
    "a servo has less voltage under its own load",
    on_shaft(burnt),
    ALL,
    share("the voltage when it is blocked", 0.3, 0.6, 1.0),
)
SHAKEN_SERVO_PLUG = Fault(
    # Truth: a servo's plug is not latched and opens when its digit moves fast. Hand: the plug sits loose. Mend: push.
    "shaken_servo_plug",
    BUS,
    Part.BUS,
    "a servo restarts now and then while it moves fast",
    restarts_at_speed,
    ALL,
    Severity("a second of fast motion", (0.3, 1.0, 3.0), 0.0, 50.0),
    at_s=0.5,
)

# Servos.
GRAIN = Fault(
    # Truth: a grain of sand sits between two gears. Hand: the spool turns hard in one place. Mend: the servo.
    "grain_in_gear",
    MOTOR,
    Part.SERVO,
    "a servo turns hard in one sector",
    on_shaft(Grain),
    ALL,
    Severity("N m", (0.1, 0.25, 0.45), 0.0, 5.0),
)
HALF_BRIDGE = Fault(
    # Truth: a transistor of the motor's bridge is dead. Hand: nothing. Mend: the servo.
    "half_bridge",
    MOTOR,
    Part.SERVO,
    "a motor pulls in the closing direction only",
    on_shaft(lambda assembly, fault: OneWay(assembly.shafts, fault.where)),
    ALL,
)
DRY_BRUSHES = Fault(
    # Truth: the commutator is oxidised; the first current after a rest takes its time. Hand: nothing. Mend: the servo.
    "dry_brushes",
    MOTOR,
    Part.SERVO,
    "a motor starts late after a rest",
    on_shaft(lambda assembly, fault: DryBrushes(assembly.shafts, fault.where, fault.severity)),
    ALL,
    Severity("s", (0.08, 0.3, 1.0), 0.0, 10.0),
)
CRACKED_MAGNET = Fault(
    # Truth: the encoder's magnet is cracked. Hand: nothing. Mend: the servo.
    "cracked_magnet",
    ENCODER,
    Part.SERVO,
    "an encoder reads too much beyond an angle",
    on_shaft(
        lambda assembly, fault: Encoder(
            assembly.shafts,
            fault.where,
            lambda true, _: true + (fault.severity * RAD_PER_COUNT if true > 1.1 else 0.0),
        )
    ),
    ALL,
    Severity("counts", (30.0, 100.0, 250.0), 0.0, 1000.0),
)
LOOSE_PINION = Fault(
    # Truth: the motor's pinion is loose on its shaft and slips when it pulls hard. Hand: nothing. Mend: the servo.
    "loose_pinion",
    MOTOR,
    Part.SERVO,
    "a servo gives no more than some torque, whatever its current",
    on_shaft(
        lambda assembly, fault: Motor(
            assembly.shafts,
            fault.where,
            lambda drive: replace(
                drive,
                current_limit=min(drive.current_limit, fault.severity * assembly.healthy.servos.stall_torque),
            ),
        )
    ),
    ALL,
    share("stall torque", 0.6, 0.35, 0.2),
)
TUNED_GAIN = Fault(
    # Truth: a tuning tool left a high gain in a servo's RAM. Hand: nothing; the digit buzzes. Mend: power-cycle.
    "tuned_gain",
    SERVO,
    Part.SERVO,
    "a servo's gain is too high since somebody tuned it",
    in_memory(lambda assembly, fault: {"kp": round(32 * fault.severity)}),
    ALL,
    Severity("of the gain", (2.0, 4.0, 7.0), 1.0, 7.9),
    alike=(Part.SETUP,),
)
OPEN_THERMISTOR = Fault(
    # Truth: a solder joint of the thermistor opens. Hand: nothing; the servo is cool. Mend: the servo.
    "open_thermistor",
    SERVO,
    Part.SERVO,
    "a servo takes itself for hot for a moment and lets go",
    open_thermistor,
    ALL,
    Severity("s between", (20.0, 8.0, 3.0), 0.5, 600.0),
    at_s=0.5,
)
SENSOR_SATURATES = Fault(
    # Truth: the current sensor's amplifier saturates. Hand: nothing. Mend: the servo.
    "sensor_saturates",
    BUS,
    Part.SERVO,
    "a servo reports no current beyond a value",
    told(
        "present_current",
        lambda fault: lambda _, value: round(math.copysign(min(abs(value), fault.severity), value)),
    ),
    ALL,
    Severity("6.5 mA", (300.0, 120.0, 40.0), 0.0, 2047.0),
)
NO_DAMPING = Fault(
    # Truth: a servo of another project has D at 0 and P at 160. Hand: nothing. Mend: 32 into registers 21 and 22.
    "no_damping",
    SERVO,
    Part.SERVO,
    "a servo has the stored gains of another project, without damping",
    in_memory(
        lambda assembly, fault: {
            **dict.fromkeys(("position_p", "kp"), round(32 * fault.severity)),
            **dict.fromkeys(("position_d", "kd"), 0),
        }
    ),
    ALL,
    Severity("of the gain", (1.0, 2.5, 5.0), 1.0, 7.9),
)

# Cables, springs, joints.
PILES_UP = Fault(
    # Truth: the cable climbs on its own turns. Hand: seen at the spool of a closed finger. Mend: the cable, wound anew.
    "cable_piles_up",
    WINDING,
    Part.DIGIT,
    "a spool becomes larger as it winds",
    on_shaft(PilesUp),
    CABLES,
    share("the radius", 0.1, 0.25, 0.5),
)
FALLS_BESIDE = Fault(
    # Truth: a guide lacks its lid; the cable falls out at a fast opening. Hand: sometimes slack. Mend: the lid.
    "falls_out_of_guide",
    WINDING,
    Part.DIGIT,
    "a cable is slack after a fast opening until it is pulled hard",
    on_shaft(FallsBeside),
    CABLES,
    Severity("mm", (2.0, 5.0, 10.0), 0.0, 30.0),
)
SHEATH_GIVES = Fault(
    # Truth: a sheath's end is not glued and gives way elastically. Hand: its end is seen to move. Mend: the sheath.
    "sheath_gives",
    WINDING,
    Part.DIGIT,
    "a cable gives way under tension",
    on_shaft(Yielding),
    CABLES,
    Severity("mm at 30 N", (1.0, 4.0, 10.0), 0.0, 30.0),
)
PINCHED = Fault(
    # Truth: the cable is laid under the thumb's base. Hand: bends hard with the thumb across. Mend: the cable's way.
    "pinched_by_thumb",
    WINDING,
    Part.DIGIT,
    "a finger's cable is squeezed while the thumb is abducted",
    on_shaft(Pinched),
    FINGERS,
    Severity("N", (4.0, 12.0, 30.0), 0.0, 200.0),
)
JUMPING_SPRING = Fault(
    # Truth: a spring's leg leaves its seat in the bent joint. Hand: limp beyond 40 deg. Mend: the spring.
    "spring_leaves_seat",
    JOINT,
    Part.DIGIT,
    "the spring of a middle joint has no effect when the joint is bent",
    jumping_spring,
    FINGERS,
    at_s=0.5,
)
GRIT = Fault(
    # Truth: grit is in the joints of a digit. Hand: bends with resistance, unevenly. Mend: clean joints.
    "grit_in_joints",
    JOINT,
    Part.DIGIT,
    "joints rub, sometimes more, sometimes less",
    grit,
    (*FINGERS, Channel.THUMB_FLEXOR),
    Severity("N m", (0.04, 0.1, 0.2), 0.0, 2.0),
    at_s=0.5,
)
TACKY = Fault(
    # Truth: glue of a label is on a fingertip. Hand: bends freely, sticks when it is closed. Mend: a clean fingertip.
    "tacky_tip",
    JOINT,
    Part.DIGIT,
    "a closed finger sticks for a while before it opens",
    tacky,
    FINGERS,
    Severity("s", (0.3, 1.2, 4.0), 0.0, 60.0),
    at_s=0.5,
)

# Set-up and board.
CABLE_TIE = Fault(
    # Truth: a cable tie round the wrist squeezes all sheaths. Hand: seen; bends as ever. Mend: cut it.
    "cable_tie",
    CABLE,
    Part.SETUP,
    "all cables rub in their sheaths",
    another_unit(lambda unit, fault: with_values(unit, "cable_friction", CABLES, lambda was: was + fault.severity)),
    severity=share("the tension", 0.1, 0.25, 0.6),
)
ON_ITS_THUMB = Fault(
    # Truth: the hand lies on the table on its thumb. Hand: seen; the thumb swings less. Mend: put it elsewhere.
    "lies_on_its_thumb",
    JOINT,
    Part.SETUP,
    "the table stops the thumb's abduction and rubs at its base",
    another_unit(lying),
    severity=share("the travel", 0.9, 0.6, 0.3),
)
LEFT_TORQUE = Fault(
    # Truth: another program's torque limit is still in the board. Hand: nothing. Mend: restart, or the torque anew.
    "left_torque",
    BOARD,
    Part.BOARD,
    "a channel is weak by a limit left in the board",
    left_torque,
    ALL,
    Severity("6.5 mA", (300.0, 120.0, 50.0), 0.0, 1023.0),
    alike=(Part.SETUP,),
)
AVERAGES = Fault(
    # Truth: a firmware of one's own build sends running averages. Hand: nothing. Mend: flash the declared firmware.
    "averaged_readings",
    BOARD,
    Part.BOARD,
    "positions, speeds and currents are running averages",
    averaging,
    severity=Severity("s", (0.05, 0.2, 0.6), 0.001, 10.0),
    alike=(Part.DRIVER,),
)

SIXTH = (
    FLOW_CONTROLLED.at(),
    GENTLE_TOOL.at(120.0),
    HALF_WORDS.at(32767.0),
    OWN_COUPLING.at(0.3),
    SHAKEN_PLUG.at(0.5),
    FLAT_BATTERY.at(0.08),
    SLOW_ADAPTER.at(0.5),
    POWER_BANK.at(4.0),
    BURNT_PIN.at(0.55, Channel.THUMB_CMC_FLEXION),
    SHAKEN_SERVO_PLUG.at(0.6, Channel.MIDDLE),
    GRAIN.at(0.35, Channel.INDEX),
    HALF_BRIDGE.at(channel=Channel.THUMB_ABDUCTION),
    DRY_BRUSHES.at(0.4, Channel.RING),
    CRACKED_MAGNET.at(180.0, Channel.MIDDLE),
    LOOSE_PINION.at(0.25, Channel.THUMB_FLEXOR),
    TUNED_GAIN.at(5.0, Channel.THUMB_CMC_FLEXION),
    OPEN_THERMISTOR.at(5.0, Channel.RING),
    SENSOR_SATURATES.at(60.0, Channel.INDEX),
    NO_DAMPING.at(5.0, Channel.PINKY),
    PILES_UP.at(0.35, Channel.RING),
    FALLS_BESIDE.at(8.0, Channel.PINKY),
    SHEATH_GIVES.at(10.0, Channel.INDEX),
    PINCHED.at(20.0, Channel.MIDDLE),
    JUMPING_SPRING.at(channel=Channel.RING),
    GRIT.at(0.15, Channel.PINKY),
    TACKY.at(1.5, Channel.MIDDLE),
    CABLE_TIE.at(0.35),
    ON_ITS_THUMB.at(0.6),
    LEFT_TORQUE.at(80.0, Channel.THUMB_CMC_FLEXION),
    AVERAGES.at(0.3),
)
