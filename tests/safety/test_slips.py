"""What the guard sees of an encoder that slips once: the table of docs/safety.md.

`SLIP_UNITS=5 pytest -s -m slow tests/safety/test_slips.py`
"""

import os
from contextlib import suppress

import pytest
from guarded_program import GuardedProgram

from aero import Channel
from aero.channels import WIRE_ORDER
from aero.protocol import MAX_CODE

UNITS = int(os.environ.get("SLIP_UNITS", "20"))
"""Plausible ones, firmware 0.2.0."""
CLOSE = [round(0.9 * MAX_CODE), 0, 0, 0, 0, 0, 0]
HALF_WAY_S = 0.2
"""Time from the command on at which a finger at full speed is in the middle of its window."""
SLIPS = {
    "with the motion": [0, 200, 300, 400, 600],
    "against the motion": [0, -400, -600, -800, -1200],
    "at rest": [0, 200, 300, 400, 600],
}
"""Counts, towards closed."""


def noticed(seed, moment, counts):
    """Return whether the guard stops a hand that closes a finger, whose encoder slips."""
    program = GuardedProgram(unit=f"plausible:{seed}", seed=seed)
    program.command([0] * 7)
    program.command(CLOSE, 3.0 if moment == "at rest" else HALF_WAY_S)
    servo = program.electronics.servos[WIRE_ORDER.index(Channel.INDEX)]
    servo.frame.set_offset(counts)
    servo.feedback.invalidate()
    program.wait(3.0)
    with suppress(AssertionError):  # a slip that nobody has seen leaves the finger off by as much
        program.end()
    return bool(program.said)


@pytest.mark.slow
@pytest.mark.parametrize("moment", SLIPS)
def test_which_slips_are_noticed(moment):
    """No healthy hand is accused."""
    seen = {counts: sum(noticed(seed, moment, counts) for seed in range(UNITS)) for counts in SLIPS[moment]}
    print(moment, seen)
    assert seen[0] == 0
