"""Arbitrary packets on the servo bus against three emulated servos and a small model of the servo protocol."""

from collections import deque

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from firmware_emulator.bench import Bench
from firmware_emulator.hand import EmulatedHand

# Address: size, low, high, signed; what the model knows of the register map (FTServo_Arduino `HLSCL.h`).
FIELDS = {
    5: (1, 0, 253, False),
    8: (1, 0, 1, False),
    9: (2, 0, 4094, False),
    11: (2, 0, 4095, False),
    28: (2, 0, 2047, False),
    33: (1, 0, 3, False),
    40: (1, 0, 2, False),
    41: (1, 0, 254, False),
    42: (2, 0, 32767, True),
    44: (2, 0, 2047, True),
    46: (2, 0, 32767, True),
    55: (1, 0, 1, False),
}
START = {5: 0, 8: 1, 9: 0, 11: 4095, 28: 1023, 33: 0, 40: 0, 41: 0, 42: 0, 44: 1023, 46: 32766, 55: 1}
STANDING = (2048, 3231, 1289)
"""Where the first three shafts stand, which is the goal that a servo starts with."""
READ_ONLY = (3, 56, 63, 69)
ID = st.sampled_from([0, 1, 2, 3, 254])
ADDRESS = st.sampled_from(sorted(FIELDS))
DATA = st.binary(min_size=1, max_size=7)


def packet(servo, code, parameters=b""):
    body = bytes((servo, len(parameters) + 2, code)) + parameters
    return b"\xff\xff" + body + bytes((255 - sum(body) % 256,))


class ModelServo:
    """A handful of registers with their ranges."""

    def __init__(self, servo):
        self.memory = bytearray(128)
        for address, value in {**START, 5: servo, 42: STANDING[servo]}.items():
            size = FIELDS[address][0]
            self.memory[address : address + size] = value.to_bytes(size, "little")
        self.held = None

    @property
    def id(self):
        return self.memory[5]

    def write(self, start, data):
        touched = {a for a, (n, *_) in FIELDS.items() if a < start + len(data) and a + n > start}
        for at, byte in enumerate(data, start):
            if any(a <= at < a + FIELDS[a][0] for a in FIELDS):
                self.memory[at] = byte
        for address in touched:
            size, low, high, signed = FIELDS[address]
            word = int.from_bytes(self.memory[address : address + size], "little")
            sign = word & 0x8000 if signed else 0
            word = min(max(word & 0x7FFF if signed else word, low), high) | (sign if word & 0x7FFF else 0)
            self.memory[address : address + size] = word.to_bytes(size, "little")
        if start < 48 and start + len(data) > 42:
            self.memory[40] = 1


class BusMachine(RuleBasedStateMachine):
    """Addresses outside the model's registers are never written, so that what it knows stays the whole truth."""

    @initialize()
    def connect(self):
        # Nobody else talks on this bus.
        self.hand = EmulatedHand(Bench(), start="bare")
        self.hand.bus.servos = self.hand.servos[:3]
        self.answers = bytearray()
        self.port = self.hand.bus.connect(self.answers.extend)
        self.servos = [ModelServo(number) for number in range(3)]
        self.script = deque(maxlen=20)

    def say(self, data, expected):
        self.script.append(data.hex(" "))
        self.answers.clear()
        self.port.write(data)
        self.hand.clock.sleep_until(self.hand.clock.now() + 0.02)
        assert bytes(self.answers) == b"".join(expected), list(self.script)

    def addressed(self, servo):
        return [model for model in self.servos if servo in {model.id, 254}]

    def answered(self, servo, code, act):
        """What comes back: one answer an ID, those of equal IDs on top of each other; of broadcasts only to a ping."""
        answers = {}
        for model in self.addressed(servo):
            number, loud = model.id, model.memory[8] or code in {1, 2}
            parameters = act(model)
            if parameters is None or not loud or (servo == 254 and code != 1):
                continue
            answer = packet(number, 0, parameters)
            before = answers.get(number, answer)
            answers[number] = bytes(a & b for a, b in zip(before, answer, strict=True))
        return [answers[number] for number in sorted(answers)]

    def unicast(self, servo, code, parameters, act):
        self.say(packet(servo, code, parameters), self.answered(servo, code, act))

    @rule(servo=ID)
    def ping(self, servo):
        self.unicast(servo, 1, b"", lambda model: b"")

    @rule(servo=ID, address=ADDRESS)
    def read(self, servo, address):
        size = FIELDS[address][0]
        self.unicast(servo, 2, bytes((address, size)), lambda model: bytes(model.memory[address : address + size]))

    @rule(servo=ID, address=ADDRESS, value=st.integers(0, 0xFFFF))
    def write(self, servo, address, value):
        data = value.to_bytes(2, "little")[: FIELDS[address][0]]
        self.unicast(servo, 3, bytes((address,)) + data, lambda model: model.write(address, data) or b"")

    @rule(servo=ID, data=st.binary(min_size=7, max_size=7))
    def write_a_goal(self, servo, data):
        self.unicast(servo, 3, b"\x29" + data, lambda model: model.write(41, data) or b"")

    @rule(servo=ID, address=st.sampled_from(READ_ONLY), value=st.integers(0, 255))
    def write_what_is_read_only(self, servo, address, value):
        self.unicast(servo, 3, bytes((address, value)), lambda model: b"")

    @rule(servo=ID, address=ADDRESS, value=st.integers(0, 255))
    def write_later(self, servo, address, value):
        def hold(model):
            model.held = address, bytes((value,))
            return b""

        self.unicast(servo, 4, bytes((address, value)), hold)

    @rule(servo=ID)
    def act(self, servo):
        def release(model):
            if model.held is not None:
                held, model.held = model.held, None
                model.write(*held)
            return b""

        self.unicast(servo, 5, b"", release)

    @rule(rows=st.dictionaries(st.integers(0, 3), st.binary(min_size=2, max_size=2), min_size=1))
    def write_together(self, rows):
        for servo, data in rows.items():
            for model in self.addressed(servo):
                model.write(46, data)
        body = b"".join(bytes((servo,)) + data for servo, data in rows.items())
        self.say(packet(254, 0x83, bytes((46, 2)) + body), [])

    @rule(servos=st.lists(st.integers(0, 3), min_size=1, max_size=5), address=ADDRESS)
    def read_together(self, servos, address):
        size = FIELDS[address][0]
        expected = []
        for servo in servos:
            expected += self.answered(servo, 2, lambda model: bytes(model.memory[address : address + size]))
        self.say(packet(254, 0x82, bytes((address, size, *servos))), expected)

    @rule(servo=ID, code=st.sampled_from([0, 7, 9, 12, 0x40, 0xFF]), data=DATA)
    def say_something_unknown(self, servo, code, data):
        self.say(packet(servo, code, data), [])

    @rule(servo=ID, address=ADDRESS, flip=st.integers(1, 255))
    def say_something_damaged(self, servo, address, flip):
        damaged = bytearray(packet(servo, 3, bytes((address, 1))))
        damaged[-1] ^= flip
        self.say(bytes(damaged), [])

    @invariant()
    def nobody_talks_unasked(self):
        if hasattr(self, "hand"):
            self.answers.clear()
            self.hand.clock.sleep_until(self.hand.clock.now() + 0.01)
            assert not self.answers


TestBusMachine = BusMachine.TestCase
TestBusMachine.settings = settings(max_examples=30, stateful_step_count=25, deadline=None)
