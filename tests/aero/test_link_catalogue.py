"""Every fault of the link in the catalogue, and what the driver makes of it: no hang, no undeclared error, no end.

The counts of docs/internals/driver.md, a million exchanges: `LINK_EXCHANGES=14300 pytest -s -m "slow or not slow"
tests/aero/test_link_catalogue.py`.
"""

import os
from collections import Counter
from contextlib import suppress
from types import SimpleNamespace

import pytest

from aero import AeroHand
from aero.errors import AeroError
from hil.emulated.faults import CATALOGUE, Schedule, parse_fault
from hil.emulated.faults.fault import FaultLayer
from hil.emulated.faults.link_faults import LinkFaults

EXCHANGES = int(os.environ.get("LINK_EXCHANGES", "300"))
LONGEST_S = 2.5
"""Of one reading."""
BEGINS_S = 0.1
"""Time at which what happens once happens."""
RESYNCHRONISED_S = 15.0
"""Of resynchronise(): two searches of 16 time-outs of 0.1 s, each with five waits of 1 s for what may be late."""
UNSEEN = {"reply_bit_flipped", "reply_stale"}
"""What nothing on this wire tells from a right reply, docs/internals/driver.md."""
NO_SCHEDULE = {"link_hangs_up", "command_delayed"}
"""Python's own ConnectionError; and what a host cannot tell from a reply that is delayed."""
SCHEDULES = [
    f"{fault.name}={severity:g}" + (f"@{BEGINS_S}" if fault.at_s else "")
    for fault in CATALOGUE.values()
    if fault.layer is FaultLayer.LINK and fault.name not in NO_SCHEDULE
    for severity in sorted(fault.steps())
]
QUICK = [text for text in SCHEDULES if text.split("=")[0].startswith("reply_byte") or "delayed" in text]


def spoil(board, text):
    """Put a fault of the catalogue between a board and its host, and return what takes it away again."""
    schedule = Schedule([parse_fault(text)], seed=7)
    say, write, now = board.say, board.write, board.clock.now
    faults = LinkFaults(schedule.fire)
    faults.say = lambda text: say(0.0, text)
    side = SimpleNamespace(link=faults, now=now, random=schedule.random)
    waiting = list(schedule.faults)

    def spoiled_say(delay_s, data):
        if waiting and now() >= waiting[0].at_s:
            fault = waiting.pop()
            fault.fault.put(side, fault).begin()
        for t, piece in faults.passed("from_hand", now() + delay_s, data):
            say(t - now(), piece)

    def spoiled_write(data):
        for _, piece in faults.passed("to_hand", now(), data):
            write(piece)

    board.say, board.write = spoiled_say, spoiled_write

    def heal():
        schedule.require_all_fired()
        board.say, board.write = say, write

    return heal


@pytest.mark.parametrize(
    "text", [text if text in QUICK else pytest.param(text, marks=pytest.mark.slow) for text in SCHEDULES]
)
def test_no_fault_of_the_link_hangs_the_driver_or_lasts(counting_board, text):
    board, found = counting_board, Counter()
    every = {board.value(count) for count in range(0x40)}
    hand = AeroHand(board, board.clock)
    heal = spoil(board, text)
    for _ in range(EXCHANGES):
        before, start = board.seen, board.clock.now()
        try:
            words = set(hand.read_codes().tolist())
        except AeroError:
            found["errors"] += 1
            with suppress(AeroError):
                hand.resynchronise()  # as the message says
        else:
            fresh = {board.value(count) for count in range(before + 1, board.seen + 1)}
            found["wrong" if len(words) > 1 or words.isdisjoint(every) else "right" if words <= fresh else "old"] += 1
        assert board.clock.now() - start < LONGEST_S + RESYNCHRONISED_S
    print(f"| `{text}` | {found['wrong']} | {found['old']} | {found['errors']} |")
    if text.split("=")[0] not in UNSEEN:
        assert found["wrong"] == found["old"] == 0
    heal()
    board.clock.sleep_until(board.clock.now() + LONGEST_S)
    hand.resynchronise()
    before, words = board.seen, hand.read_codes().tolist()
    assert words in [[board.value(count)] * 7 for count in range(before + 1, board.seen + 1)]
