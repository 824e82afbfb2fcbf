"""Hours of hand time under random faults: one emulated hand, one program after another, nothing that grows.

10 minutes of hand time, or as many as asked for, docs/safety.md: `SOAK_S=36000 pytest -s -m slow
tests/safety/test_soak.py`.
"""

import gc
import os
import random
import time
from pathlib import Path

import pytest
from guarded_program import GuardedProgram

from aero.protocol import MAX_CODE

SECONDS = float(os.environ.get("SOAK_S", "600"))
WARM_PROGRAMS = 10
"""Programs after which nothing may grow any more: caches are filled, and libraries loaded."""
OBJECTS, RSS_MIB, SLOWER = 100, 20.0, 1.5
"""What may be there more at the end than after the first programs: Python's objects, memory; time, a factor."""

FAULTS = [
    *(f"reply_{what}=0.1" for what in ("lost", "byte_dropped", "byte_doubled", "byte_inserted", "truncated", "cut")),
    "command_lost=0.1",
    "reply_delayed=400",
    "link_slow=9600",
    "link_silent=2",
    "board_restart",
    "power_cycle",
    "board_hangs",
]
SIGNALS = ["SIGINT", "SIGTERM"]
ENDINGS = ["normally", "RuntimeError", "KeyboardInterrupt", "SystemExit", "killed"]


def steps(chance):
    """Yield what a random program does, as (method, arguments)."""
    for _ in range(chance.randrange(5, 40)):
        moment = chance.choice([0.0, chance.uniform(0.0, 3.0)])
        yield chance.choices(
            [
                ("command", ([chance.randrange(MAX_CODE + 1) for _ in range(7)], chance.uniform(0.0, 2.0))),
                ("torques", ([chance.randrange(400) for _ in range(7)], chance.uniform(0.0, 1.0))),
                ("limit", (chance.choice(["torque", "speed"]), chance.randrange(7), chance.randrange(100, 1000))),
                ("poll", (chance.uniform(0.0, 2.0),)),
                ("sleep", (chance.uniform(0.0, 2.0),)),
                ("home", ()),
                ("resynchronise", ()),
                ("fault", (chance.choice(FAULTS), moment)),
                ("heal_link", (moment,)),
                ("stray_bytes", (chance.randrange(1, 16), moment)),
                ("signal", (chance.choice(SIGNALS), moment)),
            ],
            [40, 4, 8, 8, 4, 1, 1, 6, 6, 2, 1],
        )[0]


def rss_mib():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def held():
    """Return what this process holds: objects of Python, memory in MiB, file descriptors.

    Tuples are left out: caches of a few thousand numbers, which these programs never fill, are made of them.
    """
    gc.collect()
    objects = sum(type(one) is not tuple for one in gc.get_objects())
    return objects, rss_mib(), len(list(Path("/proc/self/fd").iterdir()))


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory and descriptors are read from /proc")
def test_nothing_grows_in_hours_under_random_faults():
    chance, program, took, early = random.Random(0), None, [], None
    exchanges = errors = stops = 0
    while program is None or program.clock.now() < SECONDS:
        program = GuardedProgram(after=program)
        begun_s, begun_cpu = program.clock.now(), time.process_time()
        for name, arguments in steps(chance):
            getattr(program, name)(*arguments)
        program.end(chance.choice(ENDINGS), chance.randrange(16))
        took.append((time.process_time() - begun_cpu) / (program.clock.now() - begun_s))
        exchanges, errors = exchanges + program.exchanges, errors + program.errors
        stops += bool(program.said)
        program.next_owner()
        if len(took) == WARM_PROGRAMS:
            early = held()
    assert early is not None, "too short: the first programs only fill caches"
    late, quarter = held(), max(WARM_PROGRAMS, len(took) // 4)
    first, last = (sorted(part)[len(part) // 2] for part in (took[:quarter], took[-quarter:]))
    print(
        f"{program.clock.now() / 3600:.2f} h of hand time, {len(took)} programs, {exchanges} exchanges, "
        f"{errors} errors, {stops} stops; objects {early[0]} to {late[0]}, memory {early[1]:.1f} to {late[1]:.1f} MiB, "
        f"descriptors {early[2]} to {late[2]}, CPU time for one second {1e3 * first:.1f} to {1e3 * last:.1f} ms"
    )
    assert late[0] - early[0] < OBJECTS
    assert late[1] - early[1] < RSS_MIB
    assert late[2] == early[2]
    assert last < SLOWER * first
