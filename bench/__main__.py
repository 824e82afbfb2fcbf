"""`python bench`: time each row; with `--against COMMIT`, on that commit's code in turns with this checkout's.

A stored figure would say more about the processor than about the code: interpreter and compiled code do not slow down
alike from one machine to the next. So the comparison is with a commit, on the same machine, in the same minutes.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import click
from work import ROWS

HERE = Path(__file__).resolve().parent
SLOWER = 1.15
"""Threshold of the ratio of times; above it in every run a row is slower. Chosen: three runs of one commit on a shared
machine differ by up to 10 %."""
RUNS = 2
"""Comparisons of a row; the second is made only if the first exceeds the threshold."""
ROUNDS = 3
"""Measurements of each side in one run, in turns; their medians are compared."""
LOOP = "x = 0\nfor i in range(10_000_000): x += i"
"""Loop that README's reference core runs in 0.5 s, in global scope."""

Measure = Callable[[str, Path], float]
"""Time of a row on the code in a folder, s."""


def is_slower(ratios: Sequence[float]) -> bool:
    """Return whether a row is slower than before in each of its runs."""
    return len(ratios) == RUNS and min(ratios) > SLOWER


def measured(row: str, tree: Path) -> float:
    """Run a row once in a process of its own on the code in `tree`, s.

    Raises:
        click.ClickException: the row does not run on that code; the message is the last line that it printed.
    """
    command = [sys.executable, "-P", str(HERE / "work.py"), row]
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    ran = subprocess.run(command, env=environment, check=False, capture_output=True, text=True)
    if ran.returncode:
        raise click.ClickException(f"{row} does not run: {(ran.stderr.strip().splitlines() or ['no output'])[-1]}")
    return float(ran.stdout)


def compared(row: str, here: Path, other: Path, measure: Measure = measured) -> tuple[list[float], float, float]:
    """Return the ratios of this checkout to the other in each run, and the last medians of both, s."""
    ratios: list[float] = []
    while len(ratios) < RUNS and (not ratios or ratios[-1] > SLOWER):
        pairs = [(measure(row, here), measure(row, other)) for _ in range(ROUNDS)]
        now, before = (median(side) for side in zip(*pairs, strict=True))
        ratios.append(now / before)
    return ratios, now, before


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """Check a commit out into a temporary folder.

    Raises:
        click.UsageError: git knows no such commit.
    """
    with TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        added = subprocess.run(
            ["git", "worktree", "add", "--detach", str(tree), commit],
            cwd=HERE, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if added.returncode:
            raise click.UsageError(f"cannot check out {commit}: {added.stderr.strip().splitlines()[-1]}")
        try:
            yield tree
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(tree)], cwd=HERE, check=True)


def loop_seconds() -> float:
    """Return the time of README's reference loop on this core, s."""
    start = time.perf_counter()
    exec(LOOP, {})
    return time.perf_counter() - start


@click.command()
@click.option("--against", metavar="COMMIT", help="Commit to compare with; exits with 1 if a row is slower.")
@click.option("-k", "rows", multiple=True, type=click.Choice(list(ROWS)), help="Row to measure; repeatable; else all.")
def main(against: str | None, rows: tuple[str, ...]) -> None:
    """Time the emulated hand, its driver and its commands."""
    here = HERE.parent
    load = os.getloadavg()[0]
    click.echo(f"reference loop {loop_seconds():.2f} s; load {load:.1f} on {os.cpu_count()} cores")
    if against is None:
        for row in rows or ROWS:
            click.echo(f"{row:14} {median(measured(row, here) for _ in range(ROUNDS)):9.3g} s")
        return
    slower, together = [], 0
    with checked_out(against) as other:
        for row in rows or ROWS:
            try:
                measured(row, other)  # its compiled files are written, too
            except click.ClickException as error:
                click.echo(f"{row:14} not compared with {against}: {error.message}")
                continue
            together += 1
            ratios, now, before = compared(row, here, other)
            each = " and ".join(f"{ratio:.2f}" for ratio in ratios)
            click.echo(f"{row:14} {now:9.3g} s, {before:9.3g} s at {against}: ratio {each}")
            slower += [row] if is_slower(ratios) else []
    if not together:
        raise click.UsageError(f"no row runs on {against}, so that nothing was compared")
    if slower:
        click.echo(f"slower than {against} by more than {SLOWER - 1:.0%} in each of {RUNS} runs: {', '.join(slower)}")
        sys.exit(1)


if __name__ == "__main__":
    main()
