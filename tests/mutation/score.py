"""Mutation score of the judging code: how many small mistakes in it the unit tests notice.

A seeded sample of all mutants that cosmic-ray makes is put, one by one, into a copy of the project. Each meets the unit
tests of its own package. `tox -e mutation` runs it; Ctrl-C leaves nothing behind.
"""

from __future__ import annotations

import ast
import compileall
import os
import random
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import chdir
from pathlib import Path

import click
from cosmic_ray.commands.init import init
from cosmic_ray.mutating import mutate_and_test
from cosmic_ray.testing import run_tests
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, TestOutcome

ROOT = Path(__file__).resolve().parents[2]
COPIED = ("aero", "firmware_emulator", "hil", "model", "train", "tests", "pyproject.toml")
JUDGING = ("hil/checks", "hil/verdict", "train/limits/compute.py")
"""What turns a recording into a verdict."""
NOT_JUDGING = {
    # What a hand and the simulator are told.
    "hil/checks/shared/side_by_side.py",
    "hil/checks/staircase/reachable_range.py",
    "hil/checks/staircase/check.py",
}
MOVES_A_HAND = "Target"
"""A function with an argument of this type moves a hand, and so does a class that is made from one."""
OPENS_A_HAND = "open_target"
"""A test file with this word takes seconds; it runs only for the module that it is named after."""
LONGEST_S = 120.0
"""A mutant whose tests take longer counts as noticed: it loops."""
OPTIONS = ("-xq", "-n0", "-pno:cacheprovider", "-pno:randomly", "--hypothesis-seed=0", "-m", "not slow")


@click.command(help=__doc__)
@click.option("--seed", default=1, show_default=True, help="Of the sample.")
@click.option("--size", default=200, show_default=True, help="Mutants that are drawn; all when there are fewer.")
@click.option("--least", default=90.0, show_default=True, help="Score, in per cent, below which the run fails.")
@click.argument("paths", nargs=-1)
def main(seed: int, size: int, least: float, paths: tuple[str, ...]) -> None:
    """Draw mutants of `paths`, files or folders, all the judging code when none is given, and test each."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        copy_project()
        os.environ["PYTHONPATH"] = folder
        mutants = every_mutant([path for start in paths or JUDGING for path in modules(Path(start))])
        drawn = random.Random(seed).sample(mutants, min(size, len(mutants)))
        outcome, output = run_tests(command({file for mutant in drawn for file in tests_of(mutant.module_path)}), None)
        if outcome is not TestOutcome.SURVIVED:
            raise click.ClickException(f"the tests fail without any mutant:\n{output}")
        survivors = 0
        for i, mutant in enumerate(drawn):
            result = mutate_and_test([mutant], command(tests_of(mutant.module_path)), LONGEST_S)
            if result.test_outcome is TestOutcome.INCOMPETENT or result.diff is None:
                raise click.ClickException(f"{mutant} could not be tested:\n{result.output}")
            if not result.is_killed:
                survivors += 1
                print(f"survived, {i + 1} of {len(drawn)}: {mutant.module_path}, line {mutant.start_pos[0]}")
                print(*(line for line in result.diff.splitlines()[3:] if line[:1] in "+-"), sep="\n")
            print(f"{i + 1} of {len(drawn)} mutants tested, {survivors} survived", end="\r", flush=True)
    killed = len(drawn) - survivors
    score = 100.0 * killed / len(drawn)
    print(f"seed {seed}: {killed} of {len(drawn)} mutants noticed ({score:.1f} %), drawn from {len(mutants)}")
    sys.exit(score < least)


def copy_project() -> None:
    """Copy what the tests need into the working directory, with the times of the files, and compile it."""
    for name in COPIED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy2(ROOT / name, name)
    compileall.compile_dir(".", quiet=1)


def modules(start: Path) -> list[Path]:
    """Return the files of judging code that are `start` or lie below it."""
    found = [start] if start.is_file() else sorted(start.rglob("*.py"))
    return [path for path in found if path.as_posix() not in NOT_JUDGING]


def every_mutant(paths: list[Path]) -> list[MutationSpec]:
    """Return the mutants of all code in files that judges, in the order of the text."""
    with use_db("mutants.sqlite", WorkDB.Mode.create) as work:
        init(paths, work, {})
        found = [mutant for item in work.work_items for mutant in item.mutations]
    spans = {path: list(left_out(ast.parse(path.read_text(encoding="utf-8")))) for path in paths}
    judging = [
        mutant
        for mutant in found
        if not any(first <= tuple(mutant.start_pos) < last for first, last in spans[mutant.module_path])
    ]
    return sorted(judging, key=lambda m: (m.module_path, tuple(m.start_pos), m.operator_name, m.occurrence))


def left_out(tree: ast.Module) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Yield the spans, as (line, column) to (line, column), of annotations and of what moves a hand."""
    for node in ast.walk(tree):
        match node:
            case ast.arg(annotation=ast.expr() as note) | ast.AnnAssign(annotation=note):
                yield _span(note)
            case ast.FunctionDef(returns=ast.expr() as note):
                yield _span(note)
        functions = node.body if isinstance(node, ast.ClassDef) else [node]
        if any(isinstance(function, ast.FunctionDef) and _moves(function) for function in functions):
            yield _span(node)


def _span(node: ast.expr | ast.stmt) -> tuple[tuple[int, int], tuple[int, int]]:
    return (node.lineno, node.col_offset), (node.end_lineno or 0, node.end_col_offset or 0)


def _moves(function: ast.FunctionDef) -> bool:
    notes = [argument.annotation for argument in function.args.args]
    return any(isinstance(note, ast.Name) and note.id == MOVES_A_HAND for note in notes)


def tests_of(module: Path) -> list[Path]:
    """Return the test files of a module: the one that is named after it, then those beside it that open no hand."""
    package, *folders = module.parts[:-1]
    mirrored = Path("tests", "harness" if package == "hil" else package, *folders)
    folder = next(folder for folder in (mirrored, *mirrored.parents) if folder.exists())
    name = module.parent.name if module.stem in ("measure", "run") else module.stem
    mirror = folder / f"test_{name}.py"
    others = [path for path in sorted(folder.glob("test_*.py")) if OPENS_A_HAND not in path.read_text("utf-8")]
    return [mirror, *(path for path in others if path != mirror)] if mirror.exists() else others


def command(files: Iterable[Path]) -> str:
    """Return the command that runs test files in their order."""
    return shlex.join([sys.executable, "-m", "pytest", *OPTIONS, *map(str, files)])


if __name__ == "__main__":
    main()
