"""Arbitrary host bytes against the emulated board and a small model of the host protocol, 0.2.0 on a right hand."""

import struct
from collections import deque

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.in_process import InProcessLink
from tests.firmware_emulator.conftest import stopped_bench

WORD = st.integers(0, 65535)
CHANNEL = st.integers(0, 8)
HOMED_EXTEND = [1935, 3344, 1115, 3278, 3278, 3278, 3278]
HOMED_GRASP = [797, 2161, 4095, 0, 0, 0, 0]
GETS = {0x22, 0x23, 0x24, 0x25}
HOMING_TAKES_S = 60.0


class Model:
    """What the protocol says the board answers; `None` in an answer's payload means any."""

    def __init__(self):
        self.pending = b""
        self.extend = list(HOMED_EXTEND)

    def take(self, data):
        self.pending += data
        answers = []
        while len(self.pending) >= 16:
            frame, self.pending = self.pending[:16], self.pending[16:]
            answer = self.answer(frame[0], struct.unpack("<7H", frame[2:]))
            if answer is not None:
                answers.append((frame[0], answer))
        return answers

    def answer(self, opcode, words):
        channel, value = words[:2]
        if opcode in GETS:
            return [None] * 7
        if opcode in {0x31, 0x32}:
            limit = 32766 if opcode == 0x31 else 1023
            return [channel, min(value, limit)] if channel < 7 else [0xFFFF, 0]
        if opcode == 0x02:
            new = channel & 0xFF
            return [255, new] if new > 253 else [0xFFFF] * 4
        if opcode == 0x03 and channel < 7:
            degrees = value - 65536 if value >= 32768 else value
            shift = abs(degrees) * 91 // 8
            extend = self.extend[channel] + (shift if degrees >= 0 else -shift)
            self.extend[channel] = max(0, min(4095, extend))
            return [channel, self.extend[channel]]
        if opcode == 0x01:
            self.extend = list(HOMED_EXTEND)
            return []
        return None


class BoardMachine(RuleBasedStateMachine):
    def __init__(self):
        super().__init__()
        self.hand = EmulatedHand(stopped_bench())
        self.link = InProcessLink(self.hand)
        self.model = Model()
        self.has_homed = False
        self.script = deque(maxlen=20)

    def say(self, data):
        self.script.append(data.hex(" "))
        self.link.write(data)
        answers = self.model.take(data)
        patience = HOMING_TAKES_S if any(opcode == 0x01 for opcode, _ in answers) else 0.1
        received = self.link.read(16 * len(answers), patience)
        assert len(received) == 16 * len(answers), list(self.script)
        for at, (opcode, words) in enumerate(answers):
            self.check(opcode, words, received[16 * at : 16 * at + 16])

    def check(self, opcode, expected, answer):
        assert answer[:2] == bytes((opcode, 0)), list(self.script)
        words = struct.unpack("<7H", answer[2:])
        if None not in expected:
            assert list(words) == expected + [0] * (7 - len(expected)), list(self.script)
        elif opcode == 0x25:
            assert all(20 <= word <= 90 for word in words)
        elif opcode == 0x24:
            assert all(min(word, 65536 - word) <= 1023 for word in words)

    @rule(data=st.binary(min_size=1, max_size=40))
    def send_bytes(self, data):
        self.say(data.replace(b"\x01", b"\x00"))

    @rule(opcode=st.sampled_from([0x11, 0x12]), words=st.lists(WORD, min_size=7, max_size=7))
    def command(self, opcode, words):
        self.say(struct.pack("<BB7H", opcode, 0, *words))

    @rule(opcode=st.sampled_from(sorted(GETS | {0x00, 0x04, 0x21, 0xFF})), filler=st.integers(0, 255), words=WORD)
    def ask(self, opcode, filler, words):
        self.say(struct.pack("<BB7H", opcode, filler, *[words] * 7))

    @rule(opcode=st.sampled_from([0x02, 0x03, 0x31, 0x32]), channel=CHANNEL, value=WORD)
    def set(self, opcode, channel, value):
        self.say(struct.pack("<BB7H", opcode, 0, channel, value, *[0] * 5))

    @precondition(lambda self: self.model.pending)
    @rule()
    def align(self):
        self.say(b"\xa0" * (16 - len(self.model.pending)))

    # Once a run: a homing costs as much as a hundred other steps.
    @precondition(lambda self: not self.model.pending and not self.has_homed)
    @rule()
    def home(self):
        self.has_homed = True
        self.say(b"\x01".ljust(16, b"\0"))

    @rule(seconds=st.sampled_from([0.0003, 0.01, 0.3]))
    def wait(self, seconds):
        self.hand.clock.sleep_until(self.hand.clock.now() + seconds)

    @invariant()
    def nothing_is_said_unasked(self):
        assert self.link.read(1, 0.001) == b"", list(self.script)

    @precondition(lambda self: not self.model.pending)
    @invariant()
    def positions_are_whole_counts_of_the_window(self):
        # A reading is mapped when it is taken: wait for one that knows the present window.
        self.hand.clock.sleep_until(self.hand.clock.now() + 0.03)
        self.link.write(b"\x22".ljust(16, b"\0"))
        words = struct.unpack("<7H", self.link.read(16, 0.1)[2:])
        for word, extend, grasp in zip(words, self.model.extend, HOMED_GRASP, strict=True):
            span = abs(grasp - extend)
            assert word == 0 or -(-word * span // 65535) * 65535 // span == word, list(self.script)


TestBoardMachine = BoardMachine.TestCase
TestBoardMachine.settings = settings(max_examples=10, stateful_step_count=25, deadline=None)
