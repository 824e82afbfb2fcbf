"""Workers end with the program that started them, however it ends."""

import os
import select
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

PROGRAMS = {
    "executor": """
from concurrent.futures import ProcessPoolExecutor
with ProcessPoolExecutor(2, mp_context=get_context("spawn"), initializer=end_with_the_parent) as workers:
    list(workers.map(abs, range(8)))
    os.write(1, b"working")
    sys.stdin.read()
""",
    "pool": """
with get_context("spawn").Pool(2, initializer=end_with_the_parent) as workers:
    workers.map(abs, range(8))
    os.write(1, b"working")
    sys.stdin.read()
""",
}
BEFORE = "import os, sys\nfrom multiprocessing import get_context\nfrom train.workers import end_with_the_parent\n"


@pytest.mark.parametrize("name", PROGRAMS)
def test_no_worker_outlives_a_killed_program(name, tmp_path):
    program = tmp_path / "program.py"
    program.write_text(f"{BEFORE}if __name__ == '__main__':\n" + PROGRAMS[name].replace("\n", "\n    "))
    alive, kept_by_all = os.pipe()  # its end comes when nobody holds the other side any more
    started = subprocess.Popen(
        [sys.executable, program], stdin=subprocess.PIPE, stdout=kept_by_all, start_new_session=True
    )
    os.close(kept_by_all)
    try:
        assert os.read(alive, 8) == b"working"
        started.kill()
        started.wait()
        assert select.select([alive], [], [], 20.0)[0], "a worker still holds the output of the killed program"
        assert os.read(alive, 1) == b""
    finally:
        with started.stdin:
            os.close(alive)
        started.kill()
        started.wait()
        with suppress(ProcessLookupError):
            os.killpg(started.pid, signal.SIGKILL)
