"""Small wrong changes, one at a time, and which test notices: `python -m tests.mutants --count 60 --seed 1`.

Each change is made in a copy of the checkout. The tests of a change are those of the default suite that mirror its
module, import it, or import a module that does. A seed draws by what a line says and not by where it stands: other
changes of the code leave the draw as it is.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PACKAGES = ("aero", "firmware_emulator", "simulator", "model", "hil", "train")
COMPARED = {ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==", ast.Is: "is not",
            ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in"}  # fmt: skip
COMPUTED = {ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "*", ast.Mod: "*"}
KINDS = ("comparison", "arithmetic", "sign", "constant", "condition", "both or either", "arguments", "line")
FAILING: set[str] = set()
"""Tests that were found to fail in the copy without a change, and judge nothing."""


class Mutant(NamedTuple):
    """One wrong change; `start` and `end` are offsets in the file's bytes."""

    path: str
    line: int
    kind: str
    start: int
    end: int
    new: str


def _changes(node: ast.AST) -> Iterator[tuple[str, ast.AST, str]]:
    """Yield kind, what is replaced, and by what."""
    text = ast.unparse
    match node:
        case ast.Compare(left, [operator], [right]) if type(operator) in COMPARED:
            yield "comparison", node, f"({text(left)} {COMPARED[type(operator)]} {text(right)})"
        case ast.BinOp(left, operator, right) if type(operator) in COMPUTED:
            if not any(
                isinstance(side, ast.JoinedStr | ast.List | ast.Tuple) or _is_text(side) for side in (left, right)
            ):
                yield "arithmetic", node, f"({text(left)} {COMPUTED[type(operator)]} {text(right)})"
        case ast.UnaryOp(
            ast.USub(), ast.Name() | ast.Call() | ast.Attribute() | ast.Subscript() | ast.BinOp() as operand
        ):
            yield "sign", node, f"({text(operand)})"
        case ast.Constant(bool(value)):
            yield "constant", node, str(not value)
        case ast.Constant(int(value)):
            yield "constant", node, str(value + 1)
        case ast.Constant(float(value)):
            yield "constant", node, repr(value * 1.05 if value else 0.05)
        case ast.If(test) | ast.IfExp(test) | ast.While(test):
            yield "condition", test, f"(not ({text(test)}))"
        case ast.BoolOp(operator, values):
            other = " or " if isinstance(operator, ast.And) else " and "
            yield "both or either", node, "(" + other.join(f"({text(value)})" for value in values) + ")"
        case ast.Call(function, [first, second, *rest], keywords) if not isinstance(first, ast.Starred | ast.Constant):
            swapped = ast.Call(function, [second, first, *rest], keywords)
            if not isinstance(second, ast.Starred):
                yield "arguments", node, text(swapped)
        case ast.Expr(ast.Call()) | ast.AugAssign():
            yield "line", node, "pass"


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and not isinstance(node.value, int | float)


def _executed(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below that decide something: no annotations, no words of an error, no imports for types."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns") or isinstance(node, ast.Raise | ast.JoinedStr | ast.Assert):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _executed(child)


def mutants_of(path: Path) -> list[Mutant]:
    """Return all mutants of a module."""
    source = path.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    name = path.relative_to(ROOT).as_posix()

    def offset(line: int, column: int) -> int:
        return starts[line - 1] + column

    return [
        Mutant(name, at.lineno, kind, offset(at.lineno, at.col_offset), offset(at.end_lineno, at.end_col_offset), new)
        for node in _executed(ast.parse(source))
        for kind, at, new in _changes(node)
    ]  # fmt: skip


def drawn(count: int, seed: int) -> list[Mutant]:
    """Return `count` mutants, as many of each kind as of the others."""
    lines: dict[str, list[str]] = {}

    def rank(mutant: Mutant) -> str:
        text = lines.setdefault(mutant.path, (ROOT / mutant.path).read_text("utf-8").splitlines())[mutant.line - 1]
        return hashlib.sha256(f"{seed} {mutant.path} {mutant.kind} {text.strip()} {mutant.new}".encode()).hexdigest()

    every = [mutant for package in PACKAGES for path in (ROOT / package).rglob("*.py") for mutant in mutants_of(path)]
    ranked = {kind: sorted((mutant for mutant in every if mutant.kind == kind), key=rank) for kind in KINDS}
    turns = [ranked[kind][turn] for turn in range(-(-count // len(KINDS))) for kind in KINDS]
    return turns[:count]


@cache
def _imports(path: Path) -> frozenset[str]:
    """Return dotted names that a file imports, of modules or of what is in them."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


def _module(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return parts[-1] if parts[:2] == ("tests", "support") else ".".join(parts).removesuffix(".__init__")


def chosen(path: Path, most: int) -> list[str]:
    """Return at most `most` test files of a module, closest first: mirrors, importers, importers of importers."""
    tests = [file for file in (ROOT / "tests").rglob("test_*.py") if not {"browser", "docs"} & set(file.parts)]
    between = [file for folder in (*PACKAGES, "tests/support") for file in (ROOT / folder).rglob("*.py")]
    found: dict[Path, None] = {}
    near = {path}
    for _ in range(3):
        names = {_module(file) for file in near}
        stems = {f"test_{file.stem}.py" for file in near}
        close = [test for test in tests if test not in found and (test.name in stems or _imports(test) & names)]
        # What imports little is about little: it comes first.
        found |= dict.fromkeys(sorted(close, key=lambda test: (test.name not in stems, len(_imports(test)))))
        near = {file for file in between if _imports(file) & names} - near
    return [file.relative_to(ROOT).as_posix() for file in list(found)[:most]]


def judge(mutant: Mutant, copy: Path, most: int, seconds: float) -> str:
    """Return what became of a mutant: the test that killed it, `survived`, or why that is not known."""
    tests = chosen(ROOT / mutant.path, most)
    if not tests:
        return "survived: no test imports it"
    changed = copy / mutant.path
    source = changed.read_bytes()
    wrong = source[: mutant.start] + mutant.new.encode() + source[mutant.end :]
    try:
        for _ in range(3):
            changed.write_bytes(wrong)
            ended, suspect = _run(tests, copy, seconds)
            if ended is True:
                return f"survived {len(tests)} test files"
            # A test that did not end alone is the one that the change keeps from its end, or only the last in time.
            if suspect and ended is None and _run([suspect], copy, seconds)[0]:
                return f"not known: {len(tests)} test files did not end in {seconds:.0f} s of processor time"
            changed.write_bytes(source)
            killer = suspect or tests[0]
            if _run([killer], copy, seconds)[0]:
                return f"killed by {killer}" + (", which does not end" if ended is None else "")
            FAILING.add(killer)
    finally:
        changed.write_bytes(source)
    return f"not known: {killer} fails without the change"


def _run(tests: list[str], copy: Path, seconds: float) -> tuple[bool | None, str]:
    """Return whether tests pass, None where they did not end in time, and the test at which they ended."""
    command = [sys.executable, "-m", "pytest", "-v", "-x", "-n", "0", "-m", "not slow", "-p", "no:cacheprovider"]
    command += [*tests, *(f"--deselect={test}" for test in FAILING if test not in tests)]
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1", "PYTHONUNBUFFERED": "1"}
    # Processor time, of which a test takes as much on a busy machine; what waits for ever is ended by the wall clock.
    limits = f"ulimit -t {seconds:.0f}; exec timeout {6 * seconds:.0f} " + shlex.join(command)
    done = subprocess.run(
        ["bash", "-c", limits], cwd=copy, env=environment, capture_output=True, text=True, check=False
    )
    at = [line.split(" ")[0] for line in done.stdout.splitlines() if re.match(r"tests/\S+::", line)]
    failed = [line.split(" ")[1] for line in done.stdout.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    if failed:
        return False, (failed or at or [""])[0]
    return (None if done.returncode < 0 or done.returncode > 100 else done.returncode in (0, 5)), (at or [""])[-1]


def main() -> None:
    """Print a line for each mutant, then how many were killed."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=60, help="how many changes")
    parser.add_argument("--seed", type=int, default=1, help="which changes")
    parser.add_argument("--files", type=int, default=12, help="most test files for a change")
    parser.add_argument("--seconds", type=float, default=240.0, help="longest processor time for a change")
    parser.add_argument("--first", type=int, default=0, help="the first change to judge, of those drawn")
    options = parser.parse_args()
    ends = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "checkout"
        shutil.copytree(ROOT, copy, symlinks=True, ignore=shutil.ignore_patterns(".*", "build", "__pycache__"))
        for mutant in drawn(options.count, options.seed)[options.first :]:
            begun = time.monotonic()
            ends.append(judge(mutant, copy, options.files, options.seconds))
            spent = time.monotonic() - begun
            new = " ".join(mutant.new.split())
            print(f"{mutant.path}:{mutant.line} {mutant.kind} -> {new[:60]}: {ends[-1]} ({spent:.0f} s)", flush=True)
    killed = sum(end.startswith("killed") for end in ends)
    unknown = sum(end.startswith("not known") for end in ends)
    print(f"{killed} of {len(ends)} killed, {unknown} not known")


if __name__ == "__main__":
    main()
