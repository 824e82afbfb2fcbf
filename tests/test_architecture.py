"""The rules of docs/design.md that a machine can check: who imports whom, and who reads the wall clock."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("aero", "firmware_emulator", "model", "hil", "train")

MAY_IMPORT = {
    "aero": set(),
    "firmware_emulator": set(),
    "model": {"aero", "firmware_emulator"},
    "hil": {"aero", "firmware_emulator", "model"},
    "train": {"aero", "model"},
}
ADDITIONALLY = {"hil/cli": {"train"}}
"""What single folders may import besides: the command line, where everything meets, a command's needs at its call."""
HEAVY = {
    "aero": {"mujoco", "jax", "scipy", "matplotlib", "click", "rich", "pytest"},
    "firmware_emulator": {"mujoco", "jax", "scipy", "matplotlib", "click", "rich", "pytest"},
    "model": {"jax", "click", "rich", "pytest"},
    "hil": {"jax"},
    "train": set(),
}
WALL_CLOCK_CALLS = {"time", "monotonic", "perf_counter", "sleep", "time_ns", "monotonic_ns", "perf_counter_ns"}
WALL_CLOCK_OWNERS = {"aero/clock.py", "firmware_emulator/links/pty.py"}
"""Files of aero, firmware_emulator and model that may read real time: the clock itself and the real-time link."""


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def imported_roots(path: Path) -> set[str]:
    roots = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            roots |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            roots.add(node.module.partition(".")[0])
    return roots


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_point_one_way(package: str) -> None:
    forbidden = (set(PACKAGES) - MAY_IMPORT[package] - {package}) | HEAVY[package]
    offenders = {}
    for path in sources(package):
        name = path.relative_to(ROOT).as_posix()
        bad = imported_roots(path) & (forbidden - ADDITIONALLY.get(path.parent.relative_to(ROOT).as_posix(), set()))
        if bad:
            offenders[name] = bad
    assert not offenders


def test_import_aero_costs_numpy_and_pyserial_only() -> None:
    program = "import sys; old = set(sys.modules); import aero; print(*set(sys.modules) - old)"
    loaded = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, cwd=ROOT)
    third_party = {name.partition(".")[0] for name in loaded.stdout.split()} - set(sys.stdlib_module_names)
    assert {name for name in third_party if not name.startswith("_")} <= {"aero", "numpy", "serial"}


@pytest.mark.parametrize("package", ["aero", "firmware_emulator", "model"])
def test_nothing_that_models_the_hand_reads_the_wall_clock(package: str) -> None:
    offenders = []
    for path in sources(package):
        name = path.relative_to(ROOT).as_posix()
        if name in WALL_CLOCK_OWNERS:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            called = isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "time"
            if called and node.attr in WALL_CLOCK_CALLS:
                offenders.append(f"{name}:{node.lineno}")
            if isinstance(node, ast.ImportFrom) and node.module == "time":
                offenders.append(f"{name}:{node.lineno}")
    assert not offenders


def test_every_package_is_in_the_wheel() -> None:
    project = (ROOT / "pyproject.toml").read_text()
    present = [package for package in PACKAGES if (ROOT / package).is_dir()]
    assert all(f'"{package}"' in project for package in present)
