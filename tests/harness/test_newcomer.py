"""What a newcomer touches to add a metric, an experiment, a firmware version and a fault.

Each is added to a copy of the project, in the way that CONTRIBUTING.md says, and used there. Touched files are counted;
the folder of a check counts as one, since everything about the check stands in it.
"""

import filecmp
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PACKAGES = ("aero", "firmware_emulator", "simulator", "model", "hil")


@pytest.fixture
def copy(tmp_path):
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "aero_hil.py", tmp_path)
    return tmp_path


def touched(copy):
    """Return the files of the copy that differ from the project's, the folder of a check as one."""
    files = [path.relative_to(copy) for package in PACKAGES for path in (copy / package).rglob("*") if path.is_file()]
    files = [path for path in files if path.suffix != ".pyc"]
    differing = [p for p in files if not ((ROOT / p).exists() and filecmp.cmp(ROOT / p, copy / p, shallow=False))]
    return {path.parent if path.parts[:2] == ("hil", "checks") else path for path in differing}


def edit(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    path.write_text(text.replace(old, new), encoding="utf-8")


def run(copy, program):
    """Run a program in the copy and return what it prints, word by word."""
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=copy, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_metric_is_added_in_the_folder_of_its_check(copy):
    folder = copy / "hil" / "checks" / "holding"
    edit(
        folder / "check.py",
        '"creep_percent":',
        '"peak_current": float(np.abs(pull[held, channel]).max()),\n"creep_percent":',
    )
    with (folder / "checks.toml").open("a", encoding="utf-8") as table:
        table.write(
            '\n[[metric]]\nname = "peak_current"\nunit = "A"\n'
            'side = "above"\nevidence = "torque"\non = ["fingers"]\n'
            "worse = { by = 0.2, share = 0.1 }\n"
        )
    assert touched(copy) == {Path("hil/checks/holding")}
    program = (
        "from hil import emulate\n"
        "from hil.checks import BOUNDS, EXPERIMENTS\n"
        "from hil.verdict.baseline import Baseline, regressions\n"
        "from hil.verdict.validation import validate\n"
        "with emulate() as target: done = validate(target, ['holding'])\n"
        "print(done.numbers['holding']['ring']['peak_current'] > 0.1)\n"
        "print(EXPERIMENTS['holding'].metric('peak_current', 'ring').unit)\n"
        "print([bound.side for bound in BOUNDS if bound.metric == 'peak_current'])\n"
        "worse = regressions(Baseline('mine', {}, {'holding': {'ring': {'peak_current': 0.01}}}), done.numbers)\n"
        "print([finding.passed for finding in worse if finding.check.startswith('peak_current')])\n"
    )
    assert run(copy, program) == ["True", "A", "['above']", "[False]"]


def test_an_experiment_is_a_folder(copy):
    folder = copy / "hil" / "checks" / "waiting"
    folder.mkdir()
    (folder / "check.py").write_text(
        "from aero.channels import Channel\n"
        "FURTHEST = (0.0,) * len(Channel)\n"
        "def run(target, recorder, progress):\n"
        "    recorder.begin()\n"
        "    for _ in range(2):\n"
        "        recorder.add('codes', target.clock.now(), target.hand.read_codes())\n"
        "        target.clock.sleep_until(target.clock.now() + 0.1)\n"
        "def measure(recording):\n    return {'hand': {'readings': float(len(recording['codes'].times))}}\n"
    )
    (folder / "checks.toml").write_text(
        'title = "Whether a hand waits"\nrank = 15\nhand_s = 1\n\n[[metric]]\nname = "readings"\n'
        'unit = "readings"\nevidence = "time"\non = ["hand"]\n'
    )
    assert touched(copy) == {Path("hil/checks/waiting")}
    program = (
        "from hil import emulate\n"
        "from hil.checks import DEFAULT\n"
        "from hil.report.page import render_report\n"
        "from hil.verdict.validation import validate\n"
        "with emulate() as target: done = validate(target, ['presence', 'waiting'])\n"
        "print(DEFAULT[1], done.numbers['waiting']['hand']['readings'], 'plot-waiting' in render_report(done))\n"
    )
    assert run(copy, program) == ["waiting", "2.0", "True"]


def test_a_firmware_version_is_a_row_for_the_driver_and_one_for_the_emulator(copy):
    edit(
        copy / "aero" / "firmware.py",
        ")\nFIRMWARE: dict",
        '    Firmware("9.9", "0.2.0", BootText.RESET, WEAKER, THUMB_STATES),\n)\nFIRMWARE: dict',
    )
    edit(copy / "firmware_emulator" / "firmware" / "profiles.py", "_MAIN)", '_MAIN, replace(_0_2_0, version="9.9"))')
    assert touched(copy) == {Path("aero/firmware.py"), Path("firmware_emulator/firmware/profiles.py")}
    program = (
        "from hil import emulate\n"
        "from hil.cli.options import FIRMWARE\n"
        "from hil.emulated.faults import CATALOGUE\n"
        "from hil.targets.boot_text import identify\n"
        "from hil.verdict.validation import validate\n"
        "with emulate(firmware='9.9', homed=True) as target: done = validate(target, ['presence', 'audit'])\n"
        "print(done.passed, '9.9' in FIRMWARE, 'board_runs_9.9' in CATALOGUE)\n"
        "print('9.9' in identify('Power-on detected').versions)\n"
    )
    assert run(copy, program) == ["True"] * 4


def test_a_fault_is_added_in_the_file_of_faults_like_it(copy):
    path = copy / "hil" / "emulated" / "faults" / "servo.py"
    edit(
        path,
        "FAULTS = (\n",
        'FAULTS = (\n    Fault("servo_warm", SERVO, Part.SERVO, "warm", _hot, ALL, Severity("°C", (40, 45, 50))),\n',
    )
    assert touched(copy) == {Path("hil/emulated/faults/servo.py")}
    program = (
        "from hil import emulate\n"
        "from hil.emulated.faults import parse_fault\n"
        "with emulate(faults=[parse_fault('servo_warm:ring=50')]) as target:\n"
        "    target.clock.sleep_until(target.clock.now() + 1.0)\n"
        "    print(target.hand.read_temperatures()[2] > 45)\n"
    )
    assert run(copy, program) == ["True"]
