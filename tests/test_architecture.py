"""The rules of docs/internals/design.md that a machine can check: who imports whom, and who reads the wall clock."""

import ast
import subprocess
import sys
from collections import Counter
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("aero", "firmware_emulator", "simulator", "model", "hil", "train")
LEROBOT, ROBOTS = "lerobot_robot_aero", "feetech_robots"
"""Distributions of their own, on top of `aero` and `hil`, and for the second `firmware_emulator`."""
LEAVES = {LEROBOT, ROBOTS, "examples", "tests"}
"""What nothing of ours may import."""

MAY_IMPORT = {
    "aero": set(),
    "firmware_emulator": set(),
    "simulator": {"aero"},
    "model": {"aero", "firmware_emulator", "simulator"},
    "hil": {"aero", "firmware_emulator", "simulator", "model"},
    "train": {"aero", "firmware_emulator", "simulator", "model", "hil"},
}
EMULATOR_FOR_MODEL = {"firmware_emulator.plant", "firmware_emulator.servo.parameters"}
"""What `model` may know of the electronics: the interface behind the servos, and one servo's constants."""
HIL_LAYERS = (
    {"dialogue.asker"},
    {"targets"},
    {"recordings"},
    {"checks"},
    {"verdict"},
    {"report", "view"},
    {"history"},
    {"dialogue"},
    {"emulated"},
    {"cli"},
    {"emulated.cli"},
)
"""The folders and files of `hil`, lowest first; each may import itself and what lies below."""
HEAVY = {
    "aero": {"mujoco", "jax", "scipy", "matplotlib", "click", "rich", "pytest"},
    "firmware_emulator": {"mujoco", "jax", "scipy", "matplotlib", "click", "rich", "pytest"},
    "simulator": {"jax", "click", "rich", "pytest"},
    "model": {"jax", "click", "rich", "pytest"},
    "hil": {"jax"},
    "train": set(),
}
WALL_CLOCK_CALLS = {"time", "monotonic", "perf_counter", "sleep", "time_ns", "monotonic_ns", "perf_counter_ns"}
WALL_CLOCK_OWNERS = {"aero/clock.py", "firmware_emulator/links/pty.py"}
"""Files of aero, firmware_emulator and model that may read real time: the clock itself and the real-time link."""


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imported(path: Path) -> set[str]:
    """Dotted names, of modules or of what is in them."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_point_one_way(package: str) -> None:
    forbidden = (set(PACKAGES) - MAY_IMPORT[package] - {package}) | HEAVY[package] | LEAVES
    offenders = {}
    for path in sources(package):
        if bad := {name for name in imported(path) if name.partition(".")[0] in forbidden}:
            offenders[path.relative_to(ROOT).as_posix()] = bad
    assert not offenders


def test_lerobot_hand_imports_no_training_and_no_emulator() -> None:
    files = sorted((ROOT / LEROBOT / "src").rglob("*.py"))
    found = {name.partition(".")[0] for path in files for name in imported(path)}
    assert "hil" in found  # what is searched is there
    assert not found & {"firmware_emulator", "train", "examples", "tests"}


def test_robots_of_servos_know_the_emulator_and_not_the_hand() -> None:
    files = sorted((ROOT / ROBOTS / "src").rglob("*.py"))
    found = {name for path in files for name in imported(path)}
    assert "firmware_emulator" in {name.partition(".")[0] for name in found}  # what is searched is there
    assert not {name.partition(".")[0] for name in found} & {"model", "train", "examples", "tests"}


def test_the_model_knows_no_more_of_the_electronics_than_their_plant_and_their_servo() -> None:
    offenders = {
        (module_name(path), name)
        for path in sources("model")
        for name in imported(path)
        if name.startswith("firmware_emulator") and name.rpartition(".")[0] not in EMULATOR_FOR_MODEL
    }
    assert not offenders


def test_hil_imports_downward() -> None:
    floor = {f"hil.{name}": level for level, names in enumerate(HIL_LAYERS) for name in names}
    tops = {path.name.removesuffix(".py") for path in (ROOT / "hil").iterdir() if path.suffix in ("", ".py")}
    assert tops - {"__init__", "__pycache__", "data"} == {name.split(".")[1] for name in floor}

    def home(module: str) -> str:
        """The folder or file of the table that a module lies in, the closest one; empty for none."""
        return max((name for name in floor if f"{module}.".startswith(f"{name}.")), key=len, default="")

    offenders = [
        (module_name(path), name)
        for path in sources("hil")
        for name in imported(path)
        if (own := home(module_name(path))) and (other := home(name)) and own != other and floor[other] >= floor[own]
    ]
    assert not offenders


def test_the_instrument_knows_no_emulator() -> None:
    files = [path for path in sources("hil") if "emulated" not in path.relative_to(ROOT).parts]
    found = {(module_name(path), name) for path in files for name in imported(path)}
    assert len(files) > 80  # what is searched is there
    assert not {row for row in found if row[1].partition(".")[0] in ("firmware_emulator", "model")}


def test_no_circle_between_files() -> None:
    paths = {module_name(path): path for package in PACKAGES for path in sources(package)}
    needs = {
        module: {known for name in imported(path) if (known := name if name in paths else name.rpartition(".")[0])}
        & paths.keys() - {module}
        for module, path in paths.items()
    }
    list(TopologicalSorter(needs).static_order())


@pytest.mark.parametrize("package", PACKAGES)
def test_one_module_name_has_one_meaning(package: str) -> None:
    """A command's file is named as its command, a check's code is `check.py`; every other name stands once."""
    names = [path.stem for path in sources(package) if not path.stem.startswith("__") and "cli" not in path.parts]
    names = [name for name in names if name != "check"]
    assert {name: count for name, count in Counter(names).items() if count > 1} == {}


def test_one_public_class_name_has_one_meaning() -> None:
    """Driver and emulator each state `Opcode`; the examples stand alone and have names of their own."""
    twice = {"Opcode"}
    homes: dict[str, list[str]] = {}
    for package in (*PACKAGES, LEROBOT, ROBOTS):
        for path in sources(package):
            if {"tests", "examples"} & set(path.relative_to(ROOT).parts):
                continue
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    homes.setdefault(node.name, []).append(module_name(path))
    assert len(homes) > 300  # what is searched is there
    assert {name: places for name, places in homes.items() if len(places) > 1 and name not in twice} == {}


def test_opening_a_port_loads_no_emulator() -> None:
    program = (
        "import sys, hil\n"
        "try:\n    hil.open_port('/dev/ttyNoSuchHand').__enter__()\n"
        "except hil.NoHandError:\n    print(*sys.modules)"
    )
    loaded = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, cwd=ROOT)
    names = loaded.stdout.split()
    assert "hil.targets.opening" in names
    emulator = ("firmware_emulator", "model", "simulator", "mujoco", "hil.emulated")
    assert [name for name in names if f"{name}.".startswith(tuple(f"{one}." for one in emulator))] == []


def test_validating_a_hand_on_a_port_loads_no_emulator() -> None:
    program = "import sys, hil.verdict.validation, hil.report.results; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, cwd=ROOT)
    packages = {name.partition(".")[0] for name in loaded.stdout.split()}
    assert "simulator" in packages
    assert not packages & {"firmware_emulator", "model"}


def test_import_aero_costs_numpy_and_pyserial_only() -> None:
    program = "import sys; old = set(sys.modules); import aero; print(*set(sys.modules) - old)"
    loaded = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, cwd=ROOT)
    third_party = {name.partition(".")[0] for name in loaded.stdout.split()} - set(sys.stdlib_module_names)
    assert {name for name in third_party if not name.startswith("_")} <= {"aero", "numpy", "serial"}


@pytest.mark.parametrize("package", ["aero", "firmware_emulator", "simulator", "model"])
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
