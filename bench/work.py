"""Timed work of the bench, a function a row. `python work.py ROW` runs one row once and prints its seconds.

The rows use only what every commit has had, because `python bench --against COMMIT` runs them on that commit's code,
too. Emulated hands are timed in processor time, which other programs disturb least. Round trips and program starts use
the wall clock, because another process or the disk takes part in them.
"""

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

SECONDS = 10
"""Hand time of idling and streaming, s."""
ROUND_TRIPS = 200
"""Round trips on a pseudo-terminal; their median is the row's figure."""
STARTS = 5
"""Program starts; their median is the row's figure."""


def emulated(*, real_time: bool = False) -> Any:
    """Return an emulated hand by the opener of the code that is measured."""
    import hil  # noqa: PLC0415 - a row that starts programs needs none of it

    if hasattr(hil, "emulate"):
        return hil.emulate(real_time=real_time)
    # The opener of commits before `hil.emulate`.
    return hil.open_target("pty" if real_time else "emulated")  # type: ignore[attr-defined]


def on_a_hand(work: Callable[[Any], object]) -> float:
    """Return the processor time of some work on an emulated hand, without opening it, s."""
    with emulated() as target:
        start = time.process_time()
        work(target)
        return time.process_time() - start


def staircase(target: Any) -> None:
    """Run and judge the staircase."""
    from hil.verdict.validation import validate  # noqa: PLC0415

    validate(target, ("staircase",))


def campaign(target: Any) -> None:
    """Run and judge all experiments without files, as a campaign does."""
    from hil.verdict.validation import validate  # noqa: PLC0415

    validate(target)


def files(target: Any) -> None:
    """Run all experiments, with recordings and report in a folder."""
    from hil.report.results import write_results  # noqa: PLC0415
    from hil.verdict.validation import validate  # noqa: PLC0415

    with TemporaryDirectory() as folder:
        write_results(validate(target, folder=Path(folder)), Path(folder))


def idle(target: Any) -> None:
    """Let the hand's time pass."""
    target.clock.sleep_until(target.clock.now() + SECONDS)


def stream(hertz: int) -> Callable[[Any], None]:
    """Return work that reads and commands a hand for `SECONDS` at a rate in Hz."""

    def work(target: Any) -> None:
        start = target.clock.now()
        for tick in range(SECONDS * hertz):
            target.clock.sleep_until(start + tick / hertz)
            target.hand.read_codes()
            target.hand.command_codes([37 * tick % 30000] * 7)

    return work


def round_trip() -> float:
    """Return the wall time of `GET_POS` over a pseudo-terminal, s."""
    with emulated(real_time=True) as target:

        def one() -> float:
            start = time.perf_counter()
            target.hand.read_codes()
            return time.perf_counter() - start

        return median(one() for _ in range(ROUND_TRIPS))


def start() -> float:
    """Return the wall time of `aero-hil validate --help`, s."""

    def one() -> float:
        begin = time.perf_counter()
        command = [sys.executable, "-P", "-m", "hil.cli", "validate", "--help"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - begin

    return median(one() for _ in range(STARTS))


ROWS: dict[str, Callable[[], float]] = {
    "staircase": lambda: on_a_hand(staircase),
    "campaign": lambda: on_a_hand(campaign),
    "files": lambda: on_a_hand(files),
    "idle": lambda: on_a_hand(idle),
    "stream_20_hz": lambda: on_a_hand(stream(20)),
    "stream_100_hz": lambda: on_a_hand(stream(100)),
    "get_pos": round_trip,
    "help": start,
}
"""Name of a row to its measurement, which returns seconds."""

if __name__ == "__main__":
    print(ROWS[sys.argv[1]]())
