"""A fifth set of faults that no catalogue has, as an owner meets them in a year.

Written without a look at the rules of the diagnosis, its steps, its pages, the catalogue or a stored result; whoever
writes rules of a diagnosis does not read this file. Above each fault stands the truth: the broken thing, a person's
finding by bending and looking, and the mend.
"""

import math
from dataclasses import replace

from aero.channels import CABLES, FINGERS, WIRE_ORDER, Channel
from figures.strangers.first import watching
from firmware_emulator.firmware.frames import FRAME, FRAME_SIZE, Opcode
from firmware_emulator.firmware.hands import HANDS
from firmware_emulator.servo.memory import encode_signed
from firmware_emulator.servo.models import REGISTERS
from firmware_emulator.servo.parameters import RAD_PER_COUNT
from hil.emulated.faults.assembly import Active
from hil.emulated.faults.encoder import Encoder
from hil.emulated.faults.fault import ALL, Fault, FaultLayer, Severity, share
from hil.emulated.faults.link import LinkFault
from hil.emulated.faults.link_faults import LinkEffect
from hil.emulated.faults.mechanics import JOINTS, another_unit, with_values
from hil.emulated.faults.motor import UNPOWERED, on_shaft, weaker
from hil.emulated.faults.servo import servo_of, store
from hil.emulated.faults.shaft_fault import ShaftFault
from hil.verdict.part import Part
from model.geometry.winding import SPOOL_RADIUS

CABLE, JOINT, WINDING, MOTOR = FaultLayer.CABLE, FaultLayer.JOINT, FaultLayer.WINDING, FaultLayer.MOTOR
ENCODER, SUPPLY, SERVO, BUS = FaultLayer.ENCODER, FaultLayer.SUPPLY, FaultLayer.SERVO, FaultLayer.BUS
BOARD, LINK = FaultLayer.BOARD, FaultLayer.LINK
PIECE_S = 0.002
"""Period at which a part that depends on posture or load looks at the hand, s."""


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


class Partly(Looking):
    """A motor that loses a part of its torque while `when` says so of its angle and speed."""

    def __init__(self, behind, shaft, lost, when):
        super().__init__(behind, shaft)
        self._lost, self._when, self._acts = lost, when, False

    def look(self):
        acts = self._when(float(self.behind.angles()[self.shaft]), float(self.behind.speeds()[self.shaft]))
        if acts != self._acts:
            self._acts = acts
            self.renew()

    def changed(self, drive):
        return weaker(drive, self._lost) if self._acts else drive


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


class Pressing(Looking):
    """A torque on spools from outside, which lets a hand that turns them turn them."""

    def __init__(self, assembly, fault, torques):
        super().__init__(assembly.shafts, fault.where)
        self._assembly, self._torques, self._left = assembly, torques, {}

    def look(self):
        self._press(self._torques(self._assembly.mechanics))

    def end(self):
        super().end()
        self._press({})

    def _press(self, torques):
        mechanics = self._assembly.mechanics
        for shaft in {*torques, *self._left}:
            base, total = self._left.get(shaft, (0.0, 0.0))
            now = float(mechanics._data.qfrc_applied[mechanics.compiled.shaft_dofs[shaft]])
            base = base if now == total else now
            self._left[shaft] = base, base + torques.get(shaft, 0.0)
            mechanics.twist(shaft, self._left[shaft][1])


class Slipping(Looking):
    """A spool that slips on its servo a little whenever the servo pulls too hard."""

    STEP_M, MOST_M, REST_S = 0.5e-3, 9e-3, 0.2

    def __init__(self, assembly, fault):
        super().__init__(assembly.shafts, fault.where)
        self._assembly, self._holds = assembly, fault.severity * assembly.healthy.servos.stall_torque
        self._slipped, self._next, self._change = 0.0, 0.0, None

    def look(self):
        pulls = float(self.behind.efforts()[self.shaft]) > self._holds
        if pulls and self.time >= self._next and self._slipped < self.MOST_M and self._assembly.is_running:
            self._next = self.time + self.REST_S
            kernel = self._assembly.electronics.kernel
            kernel.call_at(kernel.now, self._slip)

    def end(self):
        super().end()
        self._take_back()

    def _slip(self):
        if self.active:
            self._take_back()
            self._slipped += self.STEP_M
            longer = self._slipped
            self._change = self._assembly.changed(
                lambda unit: with_values(unit, "cable_take_up", [self.shaft], lambda was: was + longer)
            )
            self._change.begin()

    def _take_back(self):
        if self._change is not None:
            self._change.undo()
            self._change = None


class Frayed(Looking):
    """A cable that rubs in its guide while its frayed stretch passes it."""

    def __init__(self, assembly, fault, low, high):
        super().__init__(assembly.shafts, fault.where)
        self._assembly, self._fault, self._low, self._high = assembly, fault, low, high

    def look(self):
        inside = self._low < float(self._assembly.mechanics.state().angles[self.shaft]) < self._high
        tension = float(self._assembly.mechanics.glimpse().tensions[self.shaft])
        self._rub(inside * self._fault.severity * tension)

    def end(self):
        super().end()
        self._rub(0.0)

    def _rub(self, force):
        compiled = self._assembly.mechanics.compiled
        compiled.has_sheaths = True
        healthy = compiled.parameters.spool_friction[self.shaft]
        compiled._spool_friction[CABLES.index(self.shaft)] = healthy + SPOOL_RADIUS * force


def wire(shafts, lost, *, is_plug):
    """A bad wire before the motors of `shafts`; `lost` makes its law of an assembly and a fault."""
    return on_shaft(lambda assembly, fault: Wire(assembly, shafts, lost(assembly, fault), is_plug=is_plug))


def warming(assembly, fault):
    """A crimp whose resistance grows with its warmth, up to the severity with three motors blocked."""
    full = 3.0 * assembly.healthy.servos.stall_torque
    warm, last = [0.0], [None]

    def lost(effort, t):
        seconds, last[0] = (0.0 if last[0] is None else t - last[0]), t
        warm[0] += (min(effort / full, 1.5) - warm[0]) * seconds / 25.0
        return min(fault.severity * (0.2 + 2.0 * warm[0]) * effort / full, 0.6)

    return lost


def charger(assembly, fault):
    """An adapter that gives a highest current, and lowers its voltage beyond it."""
    most = fault.severity * 7.0 * assembly.healthy.servos.stall_torque
    return lambda effort, t: min(max(0.0, 1.0 - most / max(effort, most)), 0.45)


def corroded(assembly, fault):
    """A contact with a resistance."""
    full = len(FINGERS) * assembly.healthy.servos.stall_torque
    return lambda effort, t: min(fault.severity * effort / full, 0.6)


def strip(assembly, fault):
    """All power goes away for a moment, once an hour."""
    on = [False]

    def out():
        if on[0]:
            hand = assembly.electronics
            for servo in hand.servos:
                servo.power_up()
            hand.reset("brown_out")
            hand.kernel.call_at(hand.kernel.now + 3600.0, out)

    def begin():
        on[0] = True
        hand = assembly.electronics
        hand.kernel.call_at(hand.kernel.now, out)

    return Active(begin, lambda: on.__setitem__(0, False))


def plug_open_when_closed(assembly, fault):
    """A plug whose wire is pulled out of its contact by a closed finger."""
    random = assembly.random(fault)

    def look():
        if assembly.mechanics.state().angles[fault.where] > 2.6 and random.random() < fault.severity:
            assembly.fire(fault)
            servo_of(assembly.electronics, fault.where).silent_until = assembly.now() + 0.05

    return watching(assembly, 0.05, look)


def in_memory(values):
    """Other numbers in a servo's registers; what has been overwritten since is not put back."""

    def inject(assembly, fault):
        servo = servo_of(assembly.electronics, fault.where)
        wrong, right = values(assembly, fault), {}

        def put(name, value):
            sign = REGISTERS[name].sign_bit
            store(servo, name, encode_signed(value, sign) if sign else value)

        def begin():
            for name, value in wrong.items():
                right[name] = servo.memory.get(name)
                put(name, value)

        def clear():
            for name, value in right.items():
                if servo.memory.get(name) == wrong[name]:
                    put(name, value)

        return Active(begin, clear)

    return inject


def angle_limit(assembly, fault):
    """The limit that keeps a channel from the closed end of its window."""
    at, hand = WIRE_ORDER.index(fault.where), HANDS[assembly.side]
    opened, closed = hand.extend[at], hand.grasp[at]
    limit = round(opened + fault.severity * (closed - opened))
    return {"max_angle": limit} if closed > opened else {"min_angle": limit}


def second_id(assembly, fault):
    """The ID of the next servo, or of the one before."""
    own = WIRE_ORDER.index(fault.where)
    return {"secondary_id": own + 1 if own + 1 < len(WIRE_ORDER) else own - 1}


def badly_cooled(assembly, fault):
    servo = servo_of(assembly.electronics, fault.where)
    right = servo.parameters

    def begin():
        servo.parameters = replace(
            right,
            case_c_per_a2=fault.severity * right.case_c_per_a2,
            rest_temperature_c=right.rest_temperature_c + 3.0 * fault.severity,
        )

    return Active(begin, lambda: setattr(servo, "parameters", right))


def homed_on_something(assembly, fault):
    """All fingers found their closed end too early, one a little more than the other."""
    before = {}

    def put(servo, offset):
        store(servo, "offset", encode_signed(offset, REGISTERS["offset"].sign_bit))

    def begin():
        hand = HANDS[assembly.side]
        for finger, part in zip(FINGERS, (1.0, 1.1, 1.05, 0.8), strict=True):
            at, servo = WIRE_ORDER.index(finger), servo_of(assembly.electronics, finger)
            closes = 1 if hand.grasp[at] > hand.extend[at] else -1
            right = servo.memory.get("offset")
            before[finger] = right, right - closes * round(part * fault.severity)
            put(servo, before[finger][1])

    def clear():
        for finger, (right, wrong) in before.items():
            servo = servo_of(assembly.electronics, finger)
            if servo.memory.get("offset") == wrong:
                put(servo, right)

    return Active(begin, clear)


def left_speed(assembly, fault):
    """Another program's SET_SPE, in the board's memory up to its next restart."""
    at = WIRE_ORDER.index(fault.where)
    board = assembly.electronics.board
    right = board.speed[at]
    return Active(
        lambda: board.speed.__setitem__(at, round(fault.severity)), lambda: board.speed.__setitem__(at, right)
    )


def own_build(assembly, fault):
    """A firmware of one's own build that reads the servos seldom; it has homed as the declared one does."""
    hand = assembly.electronics
    right = hand._profile

    def run(profile):
        hand._profile = hand.board.profile = profile

    return Active(
        lambda: run(replace(right, telemetry_period_ms=round(fault.severity))),
        lambda: run(right),
    )


def passing(direction, make):
    """A fault of the link; `make` gives the passage of an injection."""

    def put(side, fault):
        return Active(
            lambda: side.link.add(LinkEffect(fault, direction, make(side, fault))), lambda: side.link.remove(fault)
        )

    return put


def sleeps(side, fault):
    """A port that is asleep after 0.2 s without a byte, and needs time to wake."""
    last = [-math.inf]

    def passed(data, now):
        slept, last[0] = now - last[0] > 0.2, now
        return [(fault.severity if slept else 0.0, data)]

    return passed


def backup(side, fault):
    """A computer that hands over bytes late for four of every twenty-five seconds."""
    random = side.random(fault)
    return lambda data, now: [(random.uniform(0.0, fault.severity) if now % 25.0 < 4.0 else 0.0, data)]


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


def plug_at_thumb(assembly, fault):
    """A USB plug that is pulled at by the abducted thumb."""
    random = assembly.random(fault)

    def passed(data, now):
        abducted = assembly.mechanics.state().angles[Channel.THUMB_ABDUCTION] > 0.9
        return [] if abducted and random.random() < fault.severity else [(0.0, data)]

    return passed


def linked(name, part, words, put, severity=None):
    return LinkFault(name, LINK, part, words, put, severity=severity, put=put)


def bead(assembly, fault):
    """A bead that meets the guide at an angle of the spool: from there the spool pulls at the palm."""
    meets = fault.severity

    def torques(mechanics):
        state = mechanics.state()
        past = float(state.angles[fault.where]) - meets
        return {fault.where: -6.0 * past} if past > 0.0 else {}

    return on_shaft(lambda assembly, fault: Pressing(assembly, fault, torques))(assembly, fault)


def crossed(assembly, fault):
    """Two cables that lie over each other drag each other along."""
    other = Channel(fault.where + 1) if fault.where < Channel.PINKY else Channel(fault.where - 1)

    def torques(mechanics):
        speeds, tensions = mechanics.state().speeds, mechanics.glimpse().tensions
        normal = float(min(tensions[fault.where], tensions[other]))
        drag = fault.severity * SPOOL_RADIUS * normal * math.tanh((speeds[other] - speeds[fault.where]) / 0.5)
        return {fault.where: drag, other: -drag}

    return on_shaft(lambda assembly, fault: Pressing(assembly, fault, torques))(assembly, fault)


def rubber_band(unit, fault):
    joints = [joint for finger in FINGERS for joint in JOINTS[finger][:2]]
    for field, part in (("spring_closed", 1.0), ("spring_open", 0.4)):
        unit = with_values(unit, field, joints, lambda was, part=part: was + part * fault.severity)
    return unit


def without_spring(unit, fault):
    for field in ("spring_open", "spring_closed"):
        unit = with_values(unit, field, [JOINTS[fault.where][-1]], lambda was: 0.0)
    return unit


def blind(low_deg):
    """An encoder that reads the lower edge of a sector all through it."""
    low = math.radians(low_deg)

    def make(assembly, fault):
        high = low + fault.severity * RAD_PER_COUNT
        return Encoder(assembly.shafts, fault.where, lambda true, _seconds: low if low < true < high else true)

    return on_shaft(make)


# The computer, its programs, the link.
USB_SLEEPS = linked(
    # Truth: a power-saving tool set USB autosuspend to 0.2 s. Hand: nothing. Mend: power/control = on.
    "usb_sleeps",
    Part.COMPUTER,
    "the first command after a pause arrives late",
    passing("to_hand", sleeps),
    Severity("s", (0.06, 0.2, 0.6), 0.0, 5.0),
)
BACKUP = linked(
    # Truth: a backup runs beside the program for 4 of 25 s. Hand: nothing. Mend: no backup on this computer.
    "backup_beside",
    Part.COMPUTER,
    "answers are late for a few seconds, again and again",
    passing("from_hand", backup),
    Severity("s", (0.03, 0.08, 0.2), 0.0, 5.0),
)
OWN_SCALE = linked(
    # Truth: a driver of one's own takes less than 65535 as closed. Hand: nothing. Mend: the constant in the driver.
    "own_scale",
    Part.DRIVER,
    "all goals are a fraction of those asked for",
    passing("to_hand", rewritten(lambda words, left: [round(left * word) for word in words])),
    share("each goal left", 0.97, 0.9, 0.75),
)
OWN_MAP = linked(
    # Truth: ring and pinky are swapped in the goals' map, not in the readings'. Hand: nothing. Mend: the map.
    "own_map",
    Part.DRIVER,
    "the goals of two fingers are swapped, their readings are not",
    passing("to_hand", rewritten(lambda words, _: [*words[:5], words[6], words[5]])),
)
PLUG_AT_THUMB = Fault(
    # Truth: the abducted thumb's base pulls at the USB cable. Hand: the cable is tight there. Mend: USB cable, relief.
    "plug_at_thumb",
    LINK,
    Part.USB,
    "answers get lost while the thumb is abducted",
    passing("from_hand", plug_at_thumb),
    severity=share("answers lost", 0.1, 0.4, 0.9),
)

# Supply and plugs.
CRIMP = Fault(
    # Truth: a bad crimp in the supply wire warms up under load. Hand: nothing; warm crimp. Mend: the wire.
    "crimp_warms",
    SUPPLY,
    Part.SUPPLY,
    "the voltage sags, more the longer the hand works",
    wire(tuple(ALL), warming, is_plug=True),
    severity=share("the voltage at three blocked motors", 0.1, 0.25, 0.5),
)
CHARGER = Fault(
    # Truth: the adapter is a phone charger. Hand: nothing; its label says 2 A. Mend: the right adapter.
    "phone_charger",
    SUPPLY,
    Part.SUPPLY,
    "the voltage falls as soon as several motors work together",
    wire(tuple(ALL), charger, is_plug=True),
    severity=share("the current of seven blocked motors", 0.35, 0.2, 0.1),
)
STRIP = Fault(
    # Truth: the fridge on the same strip takes the power away for a moment, once an hour. Mend: another socket.
    "socket_strip",
    SUPPLY,
    Part.SUPPLY,
    "all power is gone for a moment, once an hour",
    strip,
    at_s=40.0,
)
FINGER_BRANCH = Fault(
    # Truth: the power pin of the plug between thumb and fingers is corroded. Hand: a green pin. Mend: the plug.
    "finger_branch",
    SUPPLY,
    Part.BUS,
    "the fingers have less voltage under their own load, the thumb has all of it",
    wire(tuple(FINGERS), corroded, is_plug=False),
    severity=share("the voltage at four blocked fingers", 0.15, 0.4, 0.8),
)
PLUG_OPENS = Fault(
    # Truth: the servo's plug sits half out, and its wire is pulled when the finger is closed. Mend: push it in.
    "plug_opens",
    BUS,
    Part.BUS,
    "a servo is off the bus, most of the time, while its finger is closed",
    plug_open_when_closed,
    FINGERS,
    severity=share("the time closed", 0.1, 0.4, 0.8),
)

# Servos.
WORN_TOOTH = Fault(
    # Truth: a tooth of the last gear is worn away. Hand: a notch in the spool's turn. Mend: the servo.
    "worn_tooth",
    MOTOR,
    Part.SERVO,
    "a motor has hardly torque at one angle",
    on_shaft(
        lambda assembly, fault: Partly(
            assembly.shafts, fault.where, fault.severity, lambda angle, speed: 1.9 < angle < 2.1
        )
    ),
    ALL,
    share("torque at the tooth", 0.4, 0.75, 0.95),
)
LIFTING_BRUSHES = Fault(
    # Truth: brushes lift off the commutator at speed. Hand: nothing. Mend: the servo.
    "lifting_brushes",
    MOTOR,
    Part.SERVO,
    "a motor has less torque while it turns fast",
    on_shaft(
        lambda assembly, fault: Partly(
            assembly.shafts, fault.where, fault.severity, lambda angle, speed: abs(speed) > 4
        )
    ),
    ALL,
    share("torque at speed", 0.3, 0.6, 0.9),
)
BLIND_SECTOR = Fault(
    # Truth: the encoder has a dead sector. Hand: nothing. Mend: the servo.
    "blind_sector",
    ENCODER,
    Part.SERVO,
    "an encoder reads the same all through a small sector",
    blind(100.0),
    ALL,
    Severity("counts", (50.0, 150.0, 300.0), 0.0, 1000.0),
)
WIDE_DEAD_ZONE = Fault(
    # Truth: dead-zone registers at 16, from a forum's tip. Hand: nothing. Mend: 1 into the servo's registers 26, 27.
    "wide_dead_zone",
    SERVO,
    Part.SERVO,
    "a servo leaves errors of up to 16 counts as they are",
    in_memory(lambda assembly, fault: {"dead_zone_cw": round(fault.severity), "dead_zone_ccw": round(fault.severity)}),
    ALL,
    Severity("counts", (6.0, 10.0, 16.0), 2.0, 16.0),
)
SOFT_GAIN = Fault(
    # Truth: the position gain of a servo from an arm. Hand: nothing. Mend: 32 into the servo's register 21.
    "soft_gain",
    SERVO,
    Part.SERVO,
    "a servo's gain register is too low",
    in_memory(lambda assembly, fault: {"position_p": round(fault.severity), "kp": round(fault.severity)}),
    ALL,
    Severity("of 32", (24.0, 14.0, 7.0), 1.0, 32.0),
)
LEFT_LIMIT = Fault(
    # Truth: an older firmware's or tool's angle limit is still in a servo. Hand: nothing. Mend: registers, or homing.
    "left_limit",
    SERVO,
    Part.SERVO,
    "a servo does not go beyond an angle limit in its registers",
    in_memory(angle_limit),
    ALL,
    share("the travel", 0.85, 0.65, 0.4),
    alike=(Part.SETUP,),
)
BADLY_COOLED = Fault(
    # Truth: a servo wrapped in foam tape to fit its bay. Hand: one warm servo. Mend: the servo, without tape.
    "badly_cooled",
    SERVO,
    Part.SERVO,
    "a servo becomes warmer than the others by the same work",
    badly_cooled,
    ALL,
    Severity("times", (1.5, 3.0, 6.0), 1.0, 20.0),
)
SECOND_ID = Fault(
    # Truth: a second ID, its neighbour's, is left in a servo. Hand: nothing. Mend: 0 into the servo's register 7.
    "second_id",
    SERVO,
    Part.SERVO,
    "a servo obeys its neighbour's goals too",
    in_memory(second_id),
    ALL,
)
HALF_DUTY = Fault(
    # Truth: a bus tool left a duty limit in a servo since power-on. Hand: nothing. Mend: 1000 into register 48.
    "half_duty",
    SERVO,
    Part.SERVO,
    "a servo is slow and weak by a duty limit in its registers",
    in_memory(lambda assembly, fault: {"torque_limit": round(1000 * fault.severity)}),
    ALL,
    share("full duty", 0.7, 0.45, 0.2),
)

# Cables, springs, joints.
KNOT = Fault(
    # Truth: the knot at the fingertip slips once. Hand: bends freely, the cable is slack. Mend: a new knot.
    "knot_slips",
    CABLE,
    Part.DIGIT,
    "a cable is suddenly longer",
    another_unit(
        lambda unit, fault: with_values(unit, "cable_take_up", [fault.where], lambda was: was + 1e-3 * fault.severity)
    ),
    CABLES,
    Severity("mm", (1.5, 4.0, 9.0), 0.0, 20.0),
    at_s=25.0,
)
BEAD = Fault(
    # Truth: a bead of glue on the cable meets the guide. Hand: the finger bends freely; a bead is seen. Mend: cable.
    "glue_bead",
    WINDING,
    Part.DIGIT,
    "a cable stops at its guide before the finger is closed",
    bead,
    FINGERS,
    Severity("rad of the spool", (4.2, 3.2, 2.0), 0.5, 6.0),
)
NO_SPRING = Fault(
    # Truth: the spring of the last joint was forgotten at a repair. Hand: that joint hangs. Mend: the spring.
    "no_last_spring",
    JOINT,
    Part.DIGIT,
    "the last joint of a finger has no spring",
    another_unit(without_spring),
    (*FINGERS, Channel.THUMB_FLEXOR),
)
SPOOL_SCREW = Fault(
    # Truth: the spool's grub screw is loose. Hand: a slacker cable after each strong pull. Mend: the screw.
    "spool_screw",
    MOTOR,
    Part.DIGIT,
    "a spool slips on its servo at every strong pull",
    on_shaft(Slipping),
    CABLES,
    share("the stall torque that it holds", 0.8, 0.55, 0.35),
)
FRAYED = Fault(
    # Truth: a stretch of the cable is frayed. Hand: fluff is seen; bends as ever. Mend: the cable.
    "frayed_stretch",
    WINDING,
    Part.DIGIT,
    "a cable rubs in its guide in the middle of its travel",
    on_shaft(lambda assembly, fault: Frayed(assembly, fault, 1.2, 2.8)),
    CABLES,
    share("the tension", 0.2, 0.4, 0.8),
)
CROSSED = Fault(
    # Truth: two cables lie over each other in the palm. Hand: seen with the cover off. Mend: the cable, laid anew.
    "crossed_cables",
    WINDING,
    Part.DIGIT,
    "two fingers' cables drag each other along",
    crossed,
    FINGERS,
    share("the smaller tension", 0.2, 0.4, 0.8),
)
TIGHT_PIVOT = Fault(
    # Truth: the screw of the thumb's pivot is too tight. Hand: the thumb swings with resistance. Mend: the screw.
    "tight_pivot",
    JOINT,
    Part.DIGIT,
    "the thumb's abduction rubs in its pivot",
    another_unit(
        lambda unit, fault: with_values(unit, "joint_friction", JOINTS[fault.where], lambda was: was + fault.severity)
    ),
    (Channel.THUMB_ABDUCTION,),
    Severity("N m", (0.05, 0.1, 0.25), 0.0, 1.0),
)

# Set-up and board.
RUBBER_BAND = Fault(
    # Truth: the rubber band of the transport is still around the fingers. Hand: seen; springs more. Mend: off with it.
    "rubber_band",
    JOINT,
    Part.SETUP,
    "a rubber band pulls all fingers open",
    another_unit(rubber_band),
    severity=Severity("N m a joint", (0.02, 0.05, 0.1), 0.0, 0.3),
)
ON_BOTTLE = Fault(
    # Truth: homed with a bottle in the hand. Hand: slack cables at rest. Mend: homing with an empty hand.
    "homed_on_bottle",
    SERVO,
    Part.SETUP,
    "the fingers' zero is wrong by the size of a bottle",
    homed_on_something,
    severity=Severity("counts", (150.0, 350.0, 700.0), 0.0, 1500.0),
)
LEFT_SPEED = Fault(
    # Truth: another program's speed limit is still in the board. Hand: nothing. Mend: restart, or the speed anew.
    "left_speed",
    BOARD,
    Part.BOARD,
    "a channel moves slowly by a limit left in the board",
    left_speed,
    ALL,
    Severity("x 50 counts/s", (90.0, 40.0, 15.0), 1.0, 1000.0),
)
OWN_BUILD = Fault(
    # Truth: a firmware of one's own build reads the servos seldom. Hand: nothing. Mend: flash the declared firmware.
    "own_build",
    BOARD,
    Part.BOARD,
    "the board's readings are old",
    own_build,
    severity=Severity("ms", (20.0, 50.0, 150.0), 10.0, 1000.0),
)

FIFTH = (
    USB_SLEEPS.at(0.2),
    BACKUP.at(0.06),
    OWN_SCALE.at(0.9),
    OWN_MAP.at(),
    PLUG_AT_THUMB.at(0.4),
    CRIMP.at(0.35),
    CHARGER.at(0.16),
    STRIP.at(),
    FINGER_BRANCH.at(0.5),
    PLUG_OPENS.at(0.4, Channel.PINKY),
    WORN_TOOTH.at(0.8, Channel.MIDDLE),
    LIFTING_BRUSHES.at(0.6, Channel.THUMB_FLEXOR),
    BLIND_SECTOR.at(200.0, Channel.RING),
    WIDE_DEAD_ZONE.at(16.0, Channel.THUMB_CMC_FLEXION),
    SOFT_GAIN.at(14.0, Channel.INDEX),
    LEFT_LIMIT.at(0.55, Channel.THUMB_FLEXOR),
    BADLY_COOLED.at(4.0, Channel.RING),
    SECOND_ID.at(channel=Channel.RING),
    HALF_DUTY.at(0.45, Channel.MIDDLE),
    KNOT.at(4.0, Channel.INDEX),
    BEAD.at(3.3, Channel.MIDDLE),
    NO_SPRING.at(channel=Channel.PINKY),
    SPOOL_SCREW.at(0.5, Channel.INDEX),
    FRAYED.at(0.35, Channel.THUMB_FLEXOR),
    CROSSED.at(0.5, Channel.RING),
    TIGHT_PIVOT.at(0.1, Channel.THUMB_ABDUCTION),
    RUBBER_BAND.at(0.05),
    ON_BOTTLE.at(350.0),
    LEFT_SPEED.at(30.0, Channel.MIDDLE),
    OWN_BUILD.at(60.0),
)
