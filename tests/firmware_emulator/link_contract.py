"""What every hand owes its host, as functions that take a link factory; safe on a physical hand.

Nothing here homes, trims, changes an ID or moves a channel; settings are put back to the firmware's defaults.
"""

import struct
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol

PATIENCE_S = 2.0
SILENCE_S = 0.1
SPANS = {1138, 1183, 2980, 3278, 1025, 1296}
"""Counts between open and closed, of all channels, hands and calibration states; trimmed channels have others."""
GETS = (0x22, 0x23, 0x24, 0x25)


class Link(Protocol):
    """The part of a transport that the contract uses."""

    def write(self, data: bytes) -> None: ...

    def read(self, size: int, timeout: float) -> bytes: ...

    def discard_input(self) -> None: ...


LinkFactory = Callable[[], AbstractContextManager[Link]]


def request(opcode: int, *words: int) -> bytes:
    return struct.pack("<BB7H", opcode, 0, *words, *[0] * (7 - len(words)))


def ask(link: Link, opcode: int, *words: int) -> tuple[int, ...]:
    link.write(request(opcode, *words))
    answer = link.read(16, PATIENCE_S)
    assert len(answer) == 16, f"opcode {opcode:#x} got {len(answer)} bytes"
    assert answer[:2] == bytes((opcode, 0))
    return struct.unpack("<7H", answer[2:])


def every_reading_is_answered(open_link: LinkFactory) -> None:
    with open_link() as link:
        for opcode in GETS:
            ask(link, opcode)


def answers_come_in_the_order_of_the_questions(open_link: LinkFactory) -> None:
    with open_link() as link:
        link.write(b"".join(map(request, GETS * 3)))
        answers = link.read(16 * 12, PATIENCE_S)
        assert tuple(answers[::16]) == GETS * 3


def unknown_opcodes_are_consumed_in_silence(open_link: LinkFactory) -> None:
    with open_link() as link:
        for opcode in (0x00, 0x04, 0x21, 0x80, 0xFF):
            link.write(request(opcode))
        assert link.read(1, SILENCE_S) == b""
        ask(link, 0x22)


def commands_are_silent(open_link: LinkFactory) -> None:
    with open_link() as link:
        here = ask(link, 0x22)
        link.write(request(0x11, *here))
        assert link.read(1, SILENCE_S) == b""


def stray_bytes_cost_exactly_the_frames_until_they_add_up(open_link: LinkFactory) -> None:
    with open_link() as link:
        link.write(b"\xa0" * 3)
        link.write(b"\xa0" * 16)
        assert link.read(1, SILENCE_S) == b""
        link.write(b"\xa0" * 13)
        ask(link, 0x25)


def settings_are_acknowledged_clamped_and_refused(open_link: LinkFactory) -> None:
    with open_link() as link:
        assert ask(link, 0x31, 4, 0xFFFF)[:2] == (4, 32766)
        assert ask(link, 0x32, 4, 0xFFFF)[:2] == (4, 1023)
        assert ask(link, 0x32, 4, 700)[:2] == (4, 700)
        for opcode in (0x31, 0x32):
            assert ask(link, opcode, 7, 5) == (0xFFFF, 0, 0, 0, 0, 0, 0)


def a_trim_of_no_channel_is_silent(open_link: LinkFactory) -> None:
    with open_link() as link:
        link.write(request(0x03, 7, 10))
        assert link.read(1, SILENCE_S) == b""


def readings_are_plausible(open_link: LinkFactory) -> None:
    with open_link() as link:
        assert all(10 <= celsius <= 80 for celsius in ask(link, 0x25))
        assert all((word - 0x10000 if word >> 15 else word) in range(-1100, 1101) for word in ask(link, 0x24))
        for word in ask(link, 0x22):
            # Every position is a whole number of counts over some channel's span, truncated.
            assert any((-(-word * span // 65535)) * 65535 // span == word for span in SPANS), word


CONTRACT = (
    every_reading_is_answered,
    answers_come_in_the_order_of_the_questions,
    unknown_opcodes_are_consumed_in_silence,
    commands_are_silent,
    stray_bytes_cost_exactly_the_frames_until_they_add_up,
    settings_are_acknowledged_clamped_and_refused,
    a_trim_of_no_channel_is_silent,
    readings_are_plausible,
)
