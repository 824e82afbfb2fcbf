"""A seventh set of faults that no catalogue has, as an owner meets them in a year.

Written without a look at the rules of the diagnosis, its steps, its pages or a stored result; whoever writes rules of
a diagnosis does not read this file. Above each fault stands the truth: the broken thing, a person's finding by bending
and looking, and the mend. The hand's board has its power from USB, its servos have theirs from an adapter.
"""

import math
from dataclasses import replace

from aero.channels import CABLES, FINGERS, Channel
from figures.strangers.helpers import Mechanical, Wire, in_memory, linked, passing, rewritten, told, watching, wire
from firmware_emulator.firmware.frames import FRAME, FRAME_SIZE, Opcode
from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.encoder import Encoder
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Severity, share
from hil.emulated.faults.link_faults import LinkEffect
from hil.emulated.faults.mechanics import JOINTS, another_unit, with_values
from hil.emulated.faults.motor import Motor, on_shaft, weaker
from hil.emulated.faults.servo import servo_of
from hil.verdict.part import Part
from model.built import winding
from simulator.geometry.winding import SPOOL_RADIUS

WINDING, JOINT, MOTOR, ENCODER = FaultLayer.WINDING, FaultLayer.JOINT, FaultLayer.MOTOR, FaultLayer.ENCODER
SUPPLY, SERVO, BUS, BOARD, LINK = (
    FaultLayer.SUPPLY,
    FaultLayer.SERVO,
    FaultLayer.BUS,
    FaultLayer.BOARD,
    FaultLayer.LINK,
)
ABDUCTION = (Channel.THUMB_ABDUCTION,)


class HardGrease(Mechanical):
    """Gears that rub, most of all after a rest."""

    RESTS_S, BREAKS_RAD_S = 0.4, 0.2

    def __init__(self, assembly, fault):
        super().__init__(assembly, fault)
        self._since = 0.0

    def look(self):
        if abs(float(self.assembly.mechanics.state().speeds[self.shaft])) > self.BREAKS_RAD_S:
            self._since = self.time
        self.rub(self.severity * (1.0 if self.time - self._since > self.RESTS_S else 0.3))

    def end(self):
        super().end()
        self.rub(0.0)


class StubCatches(Mechanical):
    """A cable whose crimped end catches in its guide at random while it moves."""

    HOLDS_S, A_SECOND = 0.6, 0.8

    def __init__(self, assembly, fault):
        super().__init__(assembly, fault)
        self._random, self._until, self._last = assembly.random(fault), 0.0, 0.0

    def look(self):
        seconds, self._last = self.time - self._last, self.time
        moves = abs(float(self.assembly.mechanics.state().speeds[self.shaft])) > 0.5
        if moves and self._random.random() < self.A_SECOND * seconds:
            self._until = self.time + self.HOLDS_S
        self.rub(SPOOL_RADIUS * self.severity if self.time < self._until else 0.0)

    def end(self):
        super().end()
        self.rub(0.0)


class Rerouted(Mechanical):
    """A cable with another lever at one of its joints."""

    def __init__(self, assembly, fault, joint):
        super().__init__(assembly, fault)
        self._joint = JOINTS[fault.where][joint]

    def look(self):
        self.turn_by(self.severity)

    def end(self):
        super().end()
        self.turn_by(1.0)

    def turn_by(self, factor):
        """Set the lever of the cable at the joint, times the lever of the guide."""
        model, levers = self.compiled.model, winding(Channel(self.shaft), self.compiled.parameters)
        first = int(model.tendon_adr[self.compiled._cables[CABLES.index(self.shaft)]])
        model.wrap_prm[first + list(levers).index(self._joint)] = factor * levers[self._joint]


class FishingLine(Mechanical):
    """A cable that stretches in a second or two of tension, and creeps back without."""

    CREEPS_S = 1.5

    def __init__(self, assembly, fault):
        super().__init__(assembly, fault)
        self._longer_m, self._last = 0.0, None

    def look(self):
        seconds, self._last = 0.0 if self._last is None else self.time - self._last, self.time
        stretched = 1e-3 * self.severity * min(self.tension, 60.0) / 30.0
        self._longer_m += (stretched - self._longer_m) * min(seconds / self.CREEPS_S, 1.0)
        self.lengthen(self._longer_m)

    def end(self):
        super().end()
        self.lengthen(0.0)


class NoSupply(Wire):
    """A supply that gives nothing: no servo works or answers."""

    def __init__(self, assembly, fault):
        super().__init__(assembly, tuple(ALL), lambda effort, t: 0.0, is_plug=True)

    @property
    def supply_left(self):
        return 0.0 if self.active else 1.0

    def begin(self):
        super().begin()
        self._switch(math.inf, 0.0)
        self._assembly.electronics.reset("power_on")

    def look(self):
        """Leave the motors alone; a servo without power drives none."""

    def end(self):
        super().end()
        self._switch(-1.0, self._assembly.unit.servos.voltage)

    def _switch(self, silent_until, volts):
        for servo in self._assembly.electronics.servos:
            servo.power_up()
            servo.silent_until, servo.feedback.volts = silent_until, volts


def together(*injects):
    """Several changes that one broken thing makes."""

    def inject(assembly, fault):
        parts = [one(assembly, fault) for one in injects]
        return Active(lambda: [part.begin() for part in parts], lambda: [part.undo() for part in reversed(parts)])

    return inject


def read_otherwise(make):
    """An encoder that reads otherwise; `make` gives its law of an assembly and a fault."""
    return on_shaft(lambda assembly, fault: Encoder(assembly.shafts, fault.where, make(assembly, fault)))


def flexing(assembly, fault):
    """A case that twists under load, with the sensor in it."""
    behind, per_nm = assembly.shafts, fault.severity * RAD_PER_COUNT / assembly.healthy.servos.stall_torque
    twist, last = [0.0], [0.0]

    def reading(true, seconds):
        new = 1.0 - math.exp((last[0] - seconds) / 0.03)
        last[0] = seconds
        twist[0] += new * (per_nm * float(behind.efforts()[fault.where]) - twist[0])
        return true + twist[0]

    return reading


def glitching(assembly, fault):
    """An encoder that reads too much for 0.12 s, at random, every four seconds or so."""
    random, until, last = assembly.random(fault), [-1.0], [0.0]

    def reading(true, seconds):
        if random.random() < (seconds - last[0]) / 4.0:
            until[0] = seconds + 0.12
        last[0] = seconds
        return true + (fault.severity * RAD_PER_COUNT if seconds < until[0] else 0.0)

    return reading


def slipping_horn(assembly, fault):
    """A horn that slips on its servo's spline, a little at each strong pull inwards."""
    behind, holds = assembly.shafts, fault.severity * assembly.healthy.servos.stall_torque
    slipped, following = [0.0], [0.0]

    def reading(true, seconds):
        if float(behind.efforts()[fault.where]) > holds and seconds >= following[0] and slipped[0] < 500.0:
            slipped[0], following[0] = slipped[0] + 15.0, seconds + 0.2
        return true + slipped[0] * RAD_PER_COUNT

    return reading


def near_a_magnet(channel, part):
    """An encoder beside a magnet, which bends its reading once a turn."""

    def law(_assembly, fault):
        return lambda true, _: true + part * fault.severity * RAD_PER_COUNT * math.sin(true + channel)

    return lambda assembly, fault: assembly.insert(Encoder(assembly.shafts, channel, law(assembly, fault)))


def noise(fault):
    """Readings of a sensor without its capacitor."""
    state = [1]

    def change(now, value):
        state[0] = (1_103_515_245 * state[0] + 12_345) % 2**31
        return value + round(fault.severity * (2.0 * state[0] / 2**31 - 1.0))

    return change


def hot(assembly, fault):
    """A servo's motor that heats by the square of a current that is too high."""
    servo = servo_of(assembly.electronics, fault.where)
    right = servo.parameters
    wrong = replace(right, case_c_per_a2=(1.0 + fault.severity) ** 2 * right.case_c_per_a2)
    return Active(lambda: setattr(servo, "parameters", wrong), lambda: setattr(servo, "parameters", right))


def dragging(unit, fault):
    """The drag of a motor of which some windings are shorted."""
    drag = fault.severity * unit.servos.stall_torque / (unit.servos.no_load_speed_counts * RAD_PER_COUNT)
    return with_values(unit, "spool_damping", [fault.where], lambda was: was + drag)


def in_the_sun(assembly, fault):
    """Servos in a warm place."""
    right = {}

    def begin():
        for servo in assembly.electronics.servos:
            right[servo] = servo.parameters, servo._heat
            rest = servo.parameters.rest_temperature_c + fault.severity
            servo.parameters = replace(servo.parameters, rest_temperature_c=rest)
            servo.heat_to(sum(servo._heat) + fault.severity)

    def clear():
        for servo, (parameters, heat) in right.items():
            servo.parameters, servo._heat = parameters, heat
            servo.feedback.temperature_c = sum(heat)

    return Active(begin, clear)


def restarting(assembly, fault):
    """A servo that restarts by itself at random."""
    random = assembly.random(fault)

    def look():
        if random.random() < 0.05 / fault.severity:
            servo_of(assembly.electronics, fault.where).reboot()

    return watching(assembly, 0.05, look)


def fingers_lost(assembly, fault):
    """All fingers are off the bus for 0.3 s, at random, while one of them moves."""
    random = assembly.random(fault)

    def look():
        moves = max(abs(float(assembly.mechanics.state().speeds[finger])) for finger in FINGERS) > 0.5
        if moves and random.random() < 0.05 * fault.severity:
            assembly.fire(fault)
            for finger in FINGERS:
                servo_of(assembly.electronics, finger).silent_until = assembly.now() + 0.3

    return watching(assembly, 0.05, look)


def half_flashed(assembly, fault):
    """A board without a whole program, which waits for one after every restart."""
    hand = assembly.electronics

    def begin():
        hand.reset = lambda cause="reset", **_: type(hand).reset(hand, cause, download=True)
        hand.reset()

    return Active(begin, lambda: (vars(hand).pop("reset", None), hand.reset()))


def leaking(assembly, fault):
    """A program that answers later and later after each restart of the board."""
    started = [None, 0.0]

    def passed(data, now):
        if started[0] is not assembly.electronics.board:
            started[:] = assembly.electronics.board, now
        return [(min(1e-3 * fault.severity * (now - started[1]), 0.03), data)]

    return Active(
        lambda: assembly.link.add(LinkEffect(fault, "from_hand", passed)), lambda: assembly.link.remove(fault)
    )


def silent(side, fault):
    """A link through which nothing comes."""

    def begin():
        side.link.add(LinkEffect(fault, "to_hand", lambda data, now: []))
        side.link.add(LinkEffect(fault, "from_hand", lambda data, now: []))

    return Active(begin, lambda: side.link.remove(fault))


def choking(side, fault):
    """A dock that loses answers for a while after dense traffic."""
    traffic, last, until = [0.0], [0.0], [-1.0]

    def passed(data, now):
        traffic[0] = max(traffic[0] - 20.0 * (now - last[0]), 0.0) + 1.0
        last[0] = now
        if traffic[0] > 120.0:
            traffic[0], until[0] = 0.0, now + fault.severity
        return [] if now < until[0] else [(0.0, data)]

    return passed


def polled(side, fault):
    """A port to which another program writes a line of its own, again and again."""
    last = [0.0]

    def passed(data, now):
        if now - last[0] < fault.severity:
            return [(0.0, data)]
        last[0] = now
        return [(0.0, b"M105\n"), (0.0005, data)]

    return passed


def big_endian(side, fault):
    def passed(data, now):
        if len(data) != FRAME_SIZE or data[0] not in (Opcode.GET_CURR, Opcode.GET_VEL):
            return [(0.0, data)]
        opcode, filler, *words = FRAME.unpack(data)
        return [(0.0, FRAME.pack(opcode, filler, *((word & 0xFF) << 8 | word >> 8 for word in words)))]

    return passed


def taped(unit, fault):
    joints = JOINTS[fault.where][1:]
    unit = with_values(unit, "spring_closed", joints, lambda was: was + fault.severity)
    return with_values(unit, "joint_friction", joints, lambda was: was + 0.3 * fault.severity)


def wedged(assembly, fault):
    """Something that falls in behind a bent finger, and keeps its first joint from opening."""
    joint, low, most = JOINTS[fault.where][0], [0.0], math.radians(fault.severity)

    def stop(angle):
        compiled = assembly.mechanics.compiled
        compiled.model.jnt_range[compiled.model.joint(joint.label).id, 0] = angle

    def look():
        low[0] = min(max(low[0], float(assembly.mechanics.joint_angles()[joint]) - 0.02), most)
        stop(low[0])

    return watching(assembly, 0.004, look, lambda: stop(0.0))


# The computer, its programs, the link.
EXTENDER = linked(
    # Truth: the far box of a USB extender is dead; its port stays listed. Hand: nothing. Mend: a plain USB cable.
    "usb_extender",
    Part.USB,
    "nothing passes the link in either direction",
    silent,
)
DOCK = linked(
    # Truth: a dock's hub loses data for a while after dense traffic. Hand: nothing. Mend: a port of the computer.
    "dock_chokes",
    Part.USB,
    "answers get lost for a while after dense traffic",
    passing("from_hand", choking),
    Severity("s", (0.1, 0.4, 1.0), 0.0, 10.0),
)
SLICER = linked(
    # Truth: a 3D printer's program polls all ports for printers. Hand: nothing. Mend: end that program.
    "slicer_polls",
    Part.COMPUTER,
    "another program writes five bytes to the port again and again",
    passing("to_hand", polled),
    Severity("s between", (40.0, 12.0, 4.0), 0.1, 600.0),
)
PARITY_MARKS = linked(
    # Truth: the port's settings mark parity errors, and double each byte ff. Hand: nothing. Mend: the port opened raw.
    "parity_marks",
    Part.COMPUTER,
    "the port doubles each byte ff",
    passing("from_hand", lambda side, fault: lambda data, now: [(0.0, data.replace(b"\xff", b"\xff\xff"))]),
)
BIG_ENDIAN = linked(
    # Truth: a driver of one's own unpacks currents and speeds big-endian. Hand: nothing. Mend: the driver's format.
    "big_endian",
    Part.DRIVER,
    "currents and speeds have their bytes swapped",
    passing("from_hand", big_endian),
)
SHORT_LOOP = linked(
    # Truth: a driver of one's own loops over six of seven goals. Hand: nothing. Mend: the driver's loop.
    "short_loop",
    Part.DRIVER,
    "the last goal is always zero",
    passing("to_hand", rewritten(lambda words, _: [*words[:-1], 0])),
)

# Supply, plugs, board.
DEAD_ADAPTER = Fault(
    # Truth: the adapter's fuse is blown. Hand: limp; no voltage at the plug. Mend: the adapter.
    "dead_adapter",
    SERVO,
    Part.SUPPLY,
    "the servos have no supply at all",
    on_shaft(NoSupply),
)
SHARED_SUPPLY = Fault(
    # Truth: a robot arm on the same supply pulls the voltage down when it moves. Hand: nothing. Mend: an own supply.
    "shared_supply",
    SUPPLY,
    Part.SUPPLY,
    "the voltage is low for 3 of every 11 seconds, whatever the hand does",
    wire(tuple(ALL), lambda _, fault: lambda effort, t: fault.severity if t % 11.0 < 3.0 else 0.0, is_plug=True),
    severity=share("the voltage", 0.15, 0.35, 0.6),
)
CHAIN_PLUG = Fault(
    # Truth: the data pin of the plug between thumb and fingers is loose. Hand: the plug wobbles. Mend: the plug.
    "chain_plug",
    BUS,
    Part.BUS,
    "all fingers are off the bus for a moment, now and then, while they move",
    fingers_lost,
    severity=Severity("a second of motion", (0.1, 0.5, 2.0), 0.0, 20.0),
    at_s=0.5,
)
HALF_FLASHED = Fault(
    # Truth: the last flashing broke off half way. Hand: limp; the board's light is dark. Mend: flash again.
    "half_flashed",
    BOARD,
    Part.BOARD,
    "the board has no whole program, and answers nothing",
    half_flashed,
)
LEAK = Fault(
    # Truth: a firmware of one's own build leaks memory. Hand: nothing. Mend: flash the declared firmware.
    "leaks_memory",
    BOARD,
    Part.BOARD,
    "the board answers later and later after each restart",
    leaking,
    severity=Severity("ms a second", (0.3, 1.0, 3.0), 0.0, 100.0),
)

# Servos.
HARD_GREASE = Fault(
    # Truth: the grease of the gears is hard. Hand: the spool sticks, then turns hard. Mend: the servo.
    "hard_grease",
    MOTOR,
    Part.SERVO,
    "gears stick after a rest, and turn hard",
    on_shaft(HardGrease),
    ALL,
    Severity("N m", (0.08, 0.2, 0.35), 0.0, 5.0),
)
CASE_FLEXES = Fault(
    # Truth: a screw of the servo's case is missing; the case twists. Hand: a gap is seen. Mend: the servo.
    "case_flexes",
    ENCODER,
    Part.SERVO,
    "an encoder reads too much by the load",
    read_otherwise(flexing),
    ALL,
    Severity("counts at stall", (60.0, 150.0, 300.0), 0.0, 400.0),
)
GLITCHES = Fault(
    # Truth: a solder joint of the encoder is cracked. Hand: nothing; the digit jerks. Mend: the servo.
    "encoder_glitches",
    ENCODER,
    Part.SERVO,
    "an encoder reads too much for a moment, at random",
    read_otherwise(glitching),
    ALL,
    Severity("counts", (80.0, 250.0, 600.0), 0.0, 2048.0),
)
NOISY_SENSOR = Fault(
    # Truth: the capacitor of the current sensor is off. Hand: nothing. Mend: the servo.
    "noisy_current_sensor",
    BUS,
    Part.SERVO,
    "a servo's current reading is noisy",
    told("present_current", noise),
    ALL,
    Severity("6.5 mA at most", (25.0, 80.0, 250.0), 0.0, 2047.0),
)
SHORTED = Fault(
    # Truth: windings of the motor are shorted. Hand: the spool drags when it is turned fast. Mend: the servo.
    "shorted_windings",
    SERVO,
    Part.SERVO,
    "a motor drags, draws much and becomes warm",
    together(
        another_unit(dragging),
        hot,
        told("present_current", lambda fault: lambda _, value: round((1.0 + fault.severity) * value)),
    ),
    ALL,
    Severity("of the current more", (0.3, 0.8, 1.6), 0.0, 5.0),
)
LEAKY_BRIDGE = Fault(
    # Truth: a transistor of the bridge leaks; the motor pulls inwards a little. Hand: nothing. Mend: the servo.
    "leaky_bridge",
    MOTOR,
    Part.SERVO,
    "a motor that is on has a torque inwards besides that of its loop",
    on_shaft(
        lambda assembly, fault: Motor(
            assembly.shafts,
            fault.where,
            lambda drive: replace(
                drive,
                torque=drive.torque + fault.severity * assembly.healthy.servos.stall_torque * (drive.limit > 0.0),
            ),
        )
    ),
    ALL,
    share("stall torque", 0.15, 0.35, 0.6),
)
WATCHDOG = Fault(
    # Truth: the servo's processor hangs, and its watchdog restarts it. Hand: nothing. Mend: the servo.
    "servo_watchdog",
    SERVO,
    Part.SERVO,
    "a servo restarts at random, moving or not",
    restarting,
    ALL,
    Severity("s between", (40.0, 12.0, 4.0), 0.5, 600.0),
    at_s=0.5,
)
COUNTERFEIT = Fault(
    # Truth: a servo bought as a spare is a counterfeit. Hand: nothing; another label. Mend: a genuine servo.
    "counterfeit_servo",
    SERVO,
    Part.SERVO,
    "a servo is weak, and reports positions in steps of 16 counts",
    together(
        on_shaft(
            lambda assembly, fault: Motor(assembly.shafts, fault.where, lambda drive: weaker(drive, fault.severity))
        ),
        told("present_position", lambda fault: lambda _, value: 16 * round(value / 16)),
    ),
    ALL,
    share("torque lost", 0.2, 0.45, 0.7),
)
GRIPPER_SETTINGS = Fault(
    # Truth: a servo keeps the settings of a gripper of an arm: P, current, dead zone. Hand: nothing. Mend: registers.
    "gripper_settings",
    SERVO,
    Part.SERVO,
    "a servo has the stored gain, current and dead zone of an arm's gripper",
    in_memory(
        lambda assembly, fault: {
            **dict.fromkeys(("position_p", "kp"), 16),
            **dict.fromkeys(("dead_zone_cw", "dead_zone_ccw"), 8),
            "protection_current": round(fault.severity),
        }
    ),
    ALL,
    Severity("6.5 mA", (500.0, 250.0, 120.0), 0.0, 1023.0),
)

# Cables, springs, joints, objects.
TIED_LOW = Fault(
    # Truth: after a repair the cable is tied to the middle phalanx. Hand: seen; the tip hangs back. Mend: the cable.
    "tied_to_the_middle",
    WINDING,
    Part.DIGIT,
    "a cable does not pull the last joint",
    on_shaft(lambda assembly, fault: Rerouted(assembly, fault, 2)),
    FINGERS,
    share("the lever left", 0.5, 0.2, 0.0),
)
BOWSTRINGS = Fault(
    # Truth: the guide at the middle joint is torn out; the cable stands off it. Hand: seen. Mend: the guide.
    "cable_bowstrings",
    WINDING,
    Part.DIGIT,
    "a cable has too long a lever at the middle joint",
    on_shaft(lambda assembly, fault: Rerouted(assembly, fault, 1)),
    FINGERS,
    Severity("of the lever", (1.25, 1.6, 2.2), 1.0, 4.0),
)
COIL_BINDS = Fault(
    # Truth: a spring with too many turns binds. Hand: the middle joint stops half way. Mend: the spring.
    "coil_binds",
    JOINT,
    Part.DIGIT,
    "the spring of a middle joint stops it before its end",
    another_unit(
        lambda unit, fault: with_values(
            unit, "closed_stop", [JOINTS[fault.where][1]], lambda stop: stop * fault.severity
        )
    ),
    FINGERS,
    share("the joint's travel", 0.85, 0.6, 0.35),
)
FISHING_LINE = Fault(
    # Truth: the cable was replaced by fishing line, which creeps. Hand: bends as ever; seen. Mend: the right cable.
    "fishing_line",
    WINDING,
    Part.DIGIT,
    "a cable stretches slowly under tension",
    on_shaft(FishingLine),
    CABLES,
    Severity("mm at 30 N", (2.0, 7.0, 14.0), 0.0, 30.0),
)
STUB = Fault(
    # Truth: the crimped end of the cable catches in a guide now and then. Hand: catches, seldom. Mend: the cable.
    "stub_catches",
    WINDING,
    Part.DIGIT,
    "a cable is held at random for a moment while it moves",
    on_shaft(StubCatches),
    CABLES,
    Severity("N", (8.0, 20.0, 50.0), 0.0, 200.0),
)
TAPED = Fault(
    # Truth: tape is wound round a finger to hold a sensor. Hand: seen; its outer joints bend hard. Mend: off with it.
    "taped_finger",
    JOINT,
    Part.DIGIT,
    "tape stiffens the outer joints of a finger",
    another_unit(taped),
    FINGERS,
    Severity("N m", (0.06, 0.15, 0.3), 0.0, 2.0),
)
WEDGE = Fault(
    # Truth: a screw has fallen in behind the finger's base. Hand: seen; it does not open. Mend: take it out.
    "wedge_behind_finger",
    JOINT,
    Part.DIGIT,
    "something behind a finger keeps its first joint from opening",
    wedged,
    FINGERS,
    Severity("deg", (10.0, 25.0, 45.0), 0.0, 80.0),
    at_s=0.5,
)
HORN = Fault(
    # Truth: the horn of the thumb's abduction has lost its screw and slips. Hand: it is loose. Mend: the screw.
    "horn_slips",
    WINDING,
    Part.DIGIT,
    "the thumb's horn slips on its servo at strong pulls",
    read_otherwise(slipping_horn),
    ABDUCTION,
    share("the stall torque that it holds", 0.7, 0.5, 0.3),
)

# Set-up.
SUN = Fault(
    # Truth: the hand stands in a closed box in the sun. Hand: warm all over. Mend: put it in the shade.
    "in_the_sun",
    SERVO,
    Part.SETUP,
    "all servos are too warm, at rest too",
    in_the_sun,
    severity=Severity("°C", (10.0, 20.0, 30.0), 0.0, 60.0),
)
MAGNET = Fault(
    # Truth: the magnetic foot of a stand sits beside three servos. Hand: seen. Mend: another stand.
    "magnetic_foot",
    ENCODER,
    Part.SETUP,
    "a magnet bends the readings of three encoders",
    together(near_a_magnet(Channel.RING, 1.0), near_a_magnet(Channel.MIDDLE, 0.7), near_a_magnet(Channel.PINKY, 0.5)),
    severity=Severity("counts", (50.0, 130.0, 250.0), 0.0, 500.0),
)

SEVENTH = (
    EXTENDER.at(),
    DOCK.at(0.5),
    SLICER.at(8.0),
    PARITY_MARKS.at(),
    BIG_ENDIAN.at(),
    SHORT_LOOP.at(),
    DEAD_ADAPTER.at(),
    SHARED_SUPPLY.at(0.4),
    CHAIN_PLUG.at(0.6),
    HALF_FLASHED.at(),
    LEAK.at(1.0),
    HARD_GREASE.at(0.35, Channel.INDEX),
    CASE_FLEXES.at(250.0, Channel.MIDDLE),
    GLITCHES.at(300.0, Channel.RING),
    NOISY_SENSOR.at(120.0, Channel.PINKY),
    SHORTED.at(1.0, Channel.THUMB_FLEXOR),
    LEAKY_BRIDGE.at(0.45, Channel.THUMB_CMC_FLEXION),
    WATCHDOG.at(9.0, Channel.THUMB_ABDUCTION),
    COUNTERFEIT.at(0.5, Channel.INDEX),
    GRIPPER_SETTINGS.at(250.0, Channel.MIDDLE),
    TIED_LOW.at(0.0, Channel.RING),
    BOWSTRINGS.at(1.8, Channel.INDEX),
    COIL_BINDS.at(0.5, Channel.PINKY),
    FISHING_LINE.at(9.0, Channel.MIDDLE),
    STUB.at(30.0, Channel.THUMB_FLEXOR),
    TAPED.at(0.2, Channel.RING),
    WEDGE.at(40.0, Channel.PINKY),
    HORN.at(0.4, Channel.THUMB_ABDUCTION),
    SUN.at(20.0),
    MAGNET.at(180.0),
)
