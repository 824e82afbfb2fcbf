"""How fast the emulated hand is, as ratios to what it cannot do without; `tox -e bench`, `docs/speed.md`.

Every round measures the bare work and the whole one after the other, in processor time, and the ratio is that of the
two medians, so that a busy machine slows both. Ratios are checked against `baseline.json`. Round trips and starts of a
program are taken by the wall clock, because another process or the disk has its part in them.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np
import pytest
import serial
from bare import BareSteps
from pytest_benchmark.fixture import BenchmarkFixture

import hil
from aero.protocol import FRAME_SIZE
from hil.checks.staircase.check import Staircase, run_staircase
from hil.recordings.recorder import Recorder
from hil.report.results import write_results
from hil.targets.target import Target
from hil.verdict.validation import validate
from model import RoutedHand

HERE = Path(__file__).parent
BASELINE = json.loads((HERE / "baseline.json").read_text())["ratios"]
SECONDS = 10
"""Hand time of idling and streaming, s."""

ROUND_TRIPS = 200
"""On a pseudo-terminal, in each of three rounds."""

Work = Callable[[Target], None]


def compare(benchmark: BenchmarkFixture, name: str, bare: Callable[[], float], whole: Callable[[], float]) -> None:
    """Measure both in turn, s, and hold their ratio against the baseline, if there is one."""
    bares: list[float] = []
    wholes: list[float] = []

    def one_round() -> None:
        bares.append(bare())
        wholes.append(whole())

    benchmark.pedantic(one_round, rounds=3)
    ratio = median(wholes) / median(bares)
    benchmark.extra_info.update(row=name, bare_s=median(bares), whole_s=median(wholes), ratio=ratio)
    measured = f"{median(wholes):.3g} s over {median(bares):.3g} s is {ratio:.2f}"
    print(f"\n{name}: {measured}, baseline {BASELINE.get(name)}")
    if name in BASELINE:
        assert ratio <= BASELINE[name]["ratio"] * (1.0 + BASELINE[name]["band"])


def seconds_of(work: Callable[[], object]) -> float:
    """Return the processor time of a call, s."""
    start = time.process_time()
    work()
    return time.process_time() - start


def on_a_hand(work: Work) -> tuple[Callable[[], float], Callable[[], float]]:
    """Return what measures the bare steps of some work on an emulated hand, and what measures the work."""
    steps = BareSteps()
    with hil.open_target("emulated") as target, steps.recording():
        work(target)

    def whole() -> float:
        with hil.open_target("emulated") as target:
            return seconds_of(lambda: work(target))

    return lambda: seconds_of(steps.run), whole


def stream(hertz: int) -> Work:
    """Return work that reads and commands a hand for `SECONDS` at a rate."""

    def work(target: Target) -> None:
        start = target.clock.now()
        for i in range(SECONDS * hertz):
            target.clock.sleep_until(start + i / hertz)
            target.hand.read_codes()
            target.hand.command_codes(np.full(7, 37 * i % 30000, np.uint16))

    return work


def test_short_staircase(benchmark: BenchmarkFixture) -> None:
    def work(target: Target) -> None:
        recorder = Recorder(target, "staircase")
        run_staircase(target, recorder, RoutedHand(), Staircase(levels=3))
        recorder.finish()

    compare(benchmark, "staircase of 3 levels", *on_a_hand(work))


def test_staircase(benchmark: BenchmarkFixture) -> None:
    compare(benchmark, "staircase", *on_a_hand(lambda target: validate(target, ("staircase",))))


def test_idle(benchmark: BenchmarkFixture) -> None:
    compare(benchmark, "idle", *on_a_hand(lambda target: target.clock.sleep_until(target.clock.now() + SECONDS)))


@pytest.mark.parametrize("hertz", [20, 100])
def test_stream(benchmark: BenchmarkFixture, hertz: int) -> None:
    compare(benchmark, f"stream at {hertz} Hz", *on_a_hand(stream(hertz)))


def test_campaign(benchmark: BenchmarkFixture) -> None:
    compare(benchmark, "one validation of a campaign", *on_a_hand(validate))


def test_get_pos_on_a_pseudo_terminal(benchmark: BenchmarkFixture) -> None:
    def seconds(work: Callable[[], object], now: Callable[[], float]) -> float:
        taken = []
        for _ in range(ROUND_TRIPS):
            start = now()
            work()
            taken.append(now() - start)
        return median(taken)

    with hil.open_target("emulated") as target:
        modelled = seconds(target.hand.read_codes, target.clock.now)
    echoing = subprocess.Popen([sys.executable, HERE / "echo.py"], stdout=subprocess.PIPE, text=True)
    with echoing, hil.open_target("pty") as target:
        assert echoing.stdout is not None
        with serial.Serial(echoing.stdout.readline().strip(), timeout=1.0) as port:

            def echo() -> None:
                port.write(bytes(FRAME_SIZE))
                assert len(port.read(FRAME_SIZE)) == FRAME_SIZE

            compare(
                benchmark,
                "GET_POS on a pseudo-terminal",
                lambda: modelled + seconds(echo, time.perf_counter),
                lambda: seconds(target.hand.read_codes, time.perf_counter),
            )
        echoing.terminate()


def test_validate_with_files_and_report(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    def work(target: Target) -> None:
        write_results(validate(target, folder=tmp_path), tmp_path)

    compare(benchmark, "validate, files, report", *on_a_hand(work))


@pytest.mark.parametrize("command", [("--help",), ("validate", "--help")])
def test_help(benchmark: BenchmarkFixture, command: tuple[str, ...]) -> None:
    def children(*arguments: str) -> float:
        start = time.perf_counter()
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - start

    compare(
        benchmark,
        " ".join(command),
        lambda: median(children("-c", "import numpy, serial, click") for _ in range(5)),
        lambda: median(children("-m", "hil.cli", *command) for _ in range(5)),
    )
