"""Commands where the user's environment lacks something: never "a defect of aero-hil", and never a traceback."""

import os
import subprocess
import sys

import pytest

NOBODY = """
import pwd
def unknown(*_):
    raise KeyError("uid not found")
pwd.getpwuid = pwd.getpwnam = unknown
"""
"""A user without an entry in the password file, as `docker --user` and systemd's DynamicUser have."""
ENVIRONMENTS = {
    "no home": {"HOME": None},
    "a home that is not there": {"HOME": "/nonexistent"},
    "a locale that is not installed": {"LC_ALL": "xx_YY.bad", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"},
    "OpenGL that is not installed": {"MUJOCO_GL": "nonsense"},
    "OpenGL without a display": {"MUJOCO_GL": "egl", "DISPLAY": None},
    "backends that do not exist": {"JAX_PLATFORMS": "nonsense", "MPLBACKEND": "nonsense"},
    "no GPU": {"JAX_PLATFORMS": "cuda"},
    "a terminal without sense": {"TERM": "nonsense", "COLUMNS": "-5", "LINES": "x", "TMPDIR": "/nonexistent"},
    "no path and no place to cache": {"PATH": None, "XDG_CACHE_HOME": "/proc/x", "MPLCONFIGDIR": "/proc/x"},
}
COMMANDS = {
    "doctor": 0,
    "faults": 0,
    "validate --only presence": 0,
    "validate --hil bench": 2,
    "run-policy --seconds 0.1 --wait 0 --empty": 0,
    "evaluate steady --units 1 --episodes 1 --seconds 0.1": 0,
    "firmware build nowhere --out out": 2,
    "train steady --out run --steps 1": None,
}
"""Command to its exit code; None for one whose code depends on what is installed."""


QUICK = ("doctor", "validate --hil bench", "firmware build nowhere --out out")
PAIRS = [
    pytest.param(lacks, command, marks=() if command in QUICK or lacks == "no home" else pytest.mark.slow)
    for lacks in ENVIRONMENTS
    for command in COMMANDS
]


@pytest.mark.parametrize(("lacks", "command"), PAIRS)
def test_what_the_environment_lacks_is_no_defect_of_ours(tmp_path, lacks, command):
    (tmp_path / "sitecustomize.py").write_text(NOBODY if lacks == "no home" else "")
    changed = os.environ | {"PYTHONPATH": str(tmp_path)} | ENVIRONMENTS[lacks]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "hil.cli", *command.split()], cwd=tmp_path, capture_output=True, check=False,
        env={name: value for name, value in changed.items() if value is not None}, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    said = done.stderr.decode(errors="replace")
    assert done.returncode != 70, said
    assert "Traceback" not in said
    if lacks not in ("OpenGL that is not installed", "no GPU") and command != "doctor":
        assert COMMANDS[command] in (None, done.returncode), said
