"""Random programs on a pseudo-terminal, ended at a random moment: the hand is left open and weak.

More of them: `RANDOM_PROCESSES=100 pytest -m slow tests/safety/test_random_processes.py`. A failure prints the program,
which runs as it stands: `python program.py PORT`.
"""

import os
import random
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress

import numpy as np
import pytest

from aero.protocol import MAX_CODE
from aero.safety import Thresholds
from firmware_emulator.links.pty import PtyServer
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from model.units import load_unit

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name != "posix", reason="needs signals and pseudo-terminals")]

PROCESSES = int(os.environ.get("RANDOM_PROCESSES", "6"))
PATIENCE_S, OPEN_DEG = 60.0, 25.0
HEAD = """import os, signal, sys
from aero import Channel, open_hand
from aero.safety import Thresholds

def fail(*_):
    raise RuntimeError

signal.signal(signal.SIGUSR1, fail)
with open_hand(sys.argv[1], firmware="0.2.0", thresholds=Thresholds(stale_s=5.0, silent_s=5.0)) as hand:
    print("open", flush=True)"""
"""A busy machine may keep it from looking."""
FORK = "if not os.fork(): os.read(0, 1); os._exit(0)"
"""A worker, which lives until the end of the test."""
CUT_S = 3.0
POWER_CUT = f"power cut of {CUT_S:g} s"
ERROR = signal.SIGUSR1
"""The program's handler raises."""
ENDINGS = [signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, ERROR, POWER_CUT]


def a_program(chance):
    """Return a program that first closes some fingers, forks, sets and reads at random, and does not end by itself."""

    def move():
        codes = [chance.randrange(MAX_CODE) for _ in range(4)] + [0] * 3
        return f"hand.command_codes({codes}); hand.clock.sleep_until(hand.clock.now() + {chance.uniform(0, 1):.2f})"

    others = [
        move,
        lambda: FORK,
        lambda: f"hand.set_torque(Channel({chance.randrange(7)}), {chance.randrange(200, 700)})",
        lambda: f"hand.read_{chance.choice(['codes', 'currents', 'speeds'])}()",
    ]
    lines = [move(), *(chance.choice(others)() for _ in range(8)), f"while True: {move()}"]
    return "\n".join([HEAD, *(f"    {line}" for line in lines), ""])


@pytest.mark.parametrize("seed", range(PROCESSES))
def test_a_process_that_is_ended_leaves_the_hand_open(seed, tmp_path):
    chance = random.Random(seed)
    program, ending, after_s = a_program(chance), ENDINGS[seed % len(ENDINGS)], chance.uniform(0.0, 10.0)
    print(f"# {ending!r} after {after_s:.1f} s\n{program}")
    (tmp_path / "program.py").write_text(program)
    electronics, bench = build_emulated(load_unit("reference"), EmulatedSpec(seed=seed))
    ended, opened, leave, cut = (threading.Event() for _ in range(4))
    power, seen = [], set()

    def look():
        """Return whether to stop serving."""
        electronics.advance_plant()
        if cut.is_set():
            cut.clear()
            bench.power_off()
            power.append((time.monotonic() + CUT_S, bench.power_on))
        while power and time.monotonic() >= power[0][0]:
            power.pop()[1]()
        is_open = np.abs(np.rad2deg(bench.mechanics.joint_angles())).max() < OPEN_DEG
        limits = {servo.memory.get("goal_torque") for servo in electronics.servos}
        seen.add(frozenset(limits))
        untouched = len(seen) == 1  # it ended before the first motion
        if ended.is_set() and is_open and (untouched or limits == {Thresholds().limp_torque}):
            opened.set()
        return leave.is_set()

    link = tmp_path / "hand"  # as `emulate --link` has it: the terminal behind is another one after a power cut
    server = PtyServer(electronics, link=link)
    thread = threading.Thread(target=server.run, args=(look,))
    thread.start()
    child = subprocess.Popen(
        [sys.executable, "program.py", str(link)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=subprocess.PIPE,  # its end tells the workers to go
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    try:
        assert child.stdout.readline() == "open\n"
        with suppress(subprocess.TimeoutExpired):
            child.wait(after_s)
        assert child.poll() is None, "it ended by itself"
        if ending == POWER_CUT:
            cut.set()
        else:
            child.send_signal(ending)
        child.wait(PATIENCE_S)
        ended.set()
        assert opened.wait(PATIENCE_S), "the hand is left closed, or strong"
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
        child.communicate()
        leave.set()
        thread.join()
        server.close()
