"""What the guard sees of an encoder that slips once: the table of docs/safety.md.

`pytest -s -m slow tests/safety/test_slips.py`
"""

import pytest
from guarded_program import GuardedProgram

from aero import Channel
from aero.channels import WIRE_ORDER
from aero.protocol import MAX_CODE

UNITS = 20
CLOSE = [round(0.9 * MAX_CODE), 0, 0, 0, 0, 0, 0]
HALF_WAY_S = 0.2
"""Time from the command on at which a finger at full speed is in the middle of its window."""
SLIPS = {"motion": [0, 200, 300, 400, 600, 800], "rest": [0, 200, 300, 400, 600, 800]}
"""Counts."""
ALWAYS = 800
"""Counts that are noticed on every unit: what a servo turns in a look, twice."""


def noticed(seed, moment, counts):
    """Return whether the guard stops a hand, one of whose encoders slips in the closing or the opening direction."""
    program = GuardedProgram(unit=f"plausible:{seed}", seed=seed)
    program.command([0] * 7)
    wait_s = HALF_WAY_S if moment == "motion" else 3.0
    program.command(CLOSE, wait_s)
    assert not program.said
    servo = program.electronics.servos[WIRE_ORDER.index(Channel.INDEX)]
    servo.frame.set_offset(counts if seed % 2 else -counts)
    servo.feedback.invalidate()
    program.wait(3.0)
    stopped = "jumped" in program.said or "moved by" in program.said or "stands at" in program.said
    assert stopped == bool(program.said)
    program.end()
    return stopped


@pytest.mark.slow
@pytest.mark.parametrize("moment", SLIPS)
def test_which_slips_are_noticed(moment):
    """No healthy hand is accused, and what a servo cannot do between two looks is always seen."""
    seen = {counts: sum(noticed(seed, moment, counts) for seed in range(UNITS)) for counts in SLIPS[moment]}
    print(moment, seen)
    assert seen[0] == 0
    assert seen[ALWAYS] == UNITS
