"""Commands where the user's environment lacks something: never "a defect of aero-hil", and never a traceback."""

import json
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
QUICK = {
    "doctor": None,
    "validate --hil bench": 2,
    "firmware build nowhere --out out": 2,
    "guard /dev/none": 3,
    "setup": 130,
}
USUAL = QUICK | {"faults": 0, "validate --only presence": 0, "run-policy --seconds 0.1 --wait 0 --empty": 0}
"""Command to its exit code; None for one whose code depends on what is installed."""
COMMANDS = USUAL | {
    "evaluate steady --units 1 --episodes 1 --seconds 0.1": 0,
    "train steady --out run --steps 1": None,
}
ALL = """
import json, sys
from hil.cli import main

codes = []
for command in sys.argv[1:]:
    sys.argv[1:] = command.split()
    try:
        main()
    except SystemExit as ended:
        codes.append(ended.code or 0)
    else:
        codes.append(0)
with open("codes.json", "w") as file:
    json.dump(codes, file)
"""


@pytest.mark.parametrize(
    ("lacks", "commands"),
    [
        *((lacks, USUAL if lacks == "no home" else QUICK) for lacks in ENVIRONMENTS),
        *(pytest.param(lacks, COMMANDS, marks=pytest.mark.slow) for lacks in ENVIRONMENTS),
    ],
)
def test_what_the_environment_lacks_is_no_defect_of_ours(tmp_path, lacks, commands):
    """All commands in one process, which is started once."""
    (tmp_path / "sitecustomize.py").write_text(NOBODY if lacks == "no home" else "")
    changed = os.environ | {"PYTHONPATH": str(tmp_path)} | ENVIRONMENTS[lacks]
    done = subprocess.run(
        [sys.executable, "-P", "-c", ALL, *commands], cwd=tmp_path, capture_output=True, check=False,
        env={name: value for name, value in changed.items() if value is not None}, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    said = done.stderr.decode(errors="replace")
    assert done.returncode == 0, said
    assert "Traceback" not in said
    codes = dict(zip(commands, json.loads((tmp_path / "codes.json").read_text()), strict=True))
    assert 70 not in codes.values(), said
    if lacks not in ("OpenGL that is not installed", "no GPU"):
        assert {command: code for command, code in codes.items() if commands[command] not in (None, code)} == {}, said
