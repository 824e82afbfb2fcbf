"""A clock that is stepped, and a board in miniature that shares no code with the driver."""

import struct
from dataclasses import dataclass, field

import pytest

BOOT_TEXT = b"[BOOT] Hand Type: RIGHT_HAND\r\n\n[Init] Pinging servos...\r\n" + b"".join(
    b"  ID %d: OK\r\n" % i for i in range(7)
)


class StepClock:
    """Time that moves only when somebody waits."""

    def __init__(self):
        self.time = 0.0

    def now(self):
        return self.time

    def sleep_until(self, t):
        self.time = max(self.time, t)


@dataclass
class MiniBoard:
    """Takes frames sixteen bytes at a time, as the real one, and answers from `words` (wire order) after `delay_s`."""

    clock: StepClock = field(default_factory=StepClock)
    words: dict = field(default_factory=lambda: {op: [0x0100 * op + i for i in range(7)] for op in range(0x22, 0x26)})
    delay_s: float = 0.001
    name: str = "mini board"
    frames: list = field(default_factory=list)
    replies: dict = field(default_factory=dict)
    """Overrides: opcode to a function from the frame to [(delay, bytes), ...]."""
    written: int = 0
    gone_after: int | None = None
    """Bytes after which writing fails."""
    closed: bool = False

    def __post_init__(self):
        self.queue = bytearray()
        self.on_the_way = []

    def say(self, delay_s, data):
        self.on_the_way.append((self.clock.now() + delay_s, data))
        self.on_the_way.sort(key=lambda entry: entry[0])

    def write(self, data):
        if self.gone_after is not None and self.written + len(data) > self.gone_after:
            self.queue += data[: self.gone_after - self.written]
            raise ConnectionError("the mini board is gone")
        self.written += len(data)
        self.queue += data
        while len(self.queue) >= 16:
            frame = bytes(self.queue[:16])
            del self.queue[:16]
            self.frames.append(frame)
            for delay_s, reply in self.replies.get(frame[0], self.answer)(frame):
                self.say(delay_s, reply)

    def answer(self, frame):
        opcode, (w0, w1) = frame[0], struct.unpack_from("<2H", frame, 2)
        if opcode in self.words:
            return [(self.delay_s, struct.pack("<BB7H", opcode, 0, *self.words[opcode]))]
        acknowledged = {
            0x01: [0] * 7,
            0x02: [9, w0, w1, 0, 0, 0, 0],
            0x03: [w0, 2141, 0, 0, 0, 0, 0],
            0x31: [w0, min(w1, 32766), 0, 0, 0, 0, 0],
            0x32: [w0, min(w1, 1023), 0, 0, 0, 0, 0],
        }
        return (
            [(self.delay_s, struct.pack("<BB7H", opcode, 0, *acknowledged[opcode]))] if opcode in acknowledged else []
        )

    def read(self, size, timeout):
        deadline = self.clock.now() + timeout
        received = b""
        while len(received) < size and self.on_the_way and self.on_the_way[0][0] <= deadline:
            time, data = self.on_the_way.pop(0)
            self.clock.sleep_until(time)
            taken, rest = data[: size - len(received)], data[size - len(received) :]
            received += taken
            if rest:
                self.on_the_way.insert(0, (time, rest))
        if len(received) < size:
            self.clock.sleep_until(deadline)
        return received

    def discard_input(self):
        self.on_the_way = [(time, data) for time, data in self.on_the_way if time > self.clock.now()]

    def close(self):
        self.closed = True


@dataclass
class CountingBoard(MiniBoard):
    """Its readings are its count of requests, in all seven words, so that a late or a shifted one shows."""

    seen: int = 0

    def __post_init__(self):
        super().__post_init__()
        self.replies = dict.fromkeys(range(0x22, 0x26), self.count)

    @staticmethod
    def value(count):
        """Return a word of two equal bytes, unlike those of the next count; 0x40 to 0x7f makes no head of a frame."""
        return 0x0101 * (0x40 + count % 0x40)

    def count(self, frame):
        self.seen += 1
        return [(self.delay_s, struct.pack("<BB7H", frame[0], 0, *[self.value(self.seen)] * 7))]


@pytest.fixture
def board():
    return MiniBoard()


@pytest.fixture
def counting_board():
    return CountingBoard()


@pytest.fixture(scope="session")
def new_board():
    """The class itself, for properties that need a fresh board for every example."""
    return MiniBoard


@pytest.fixture(scope="session")
def boot_text():
    return BOOT_TEXT
