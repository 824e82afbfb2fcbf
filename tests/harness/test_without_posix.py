"""What a system without pseudo-terminals can do, as Windows: everything in process, and hands on ports."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
# pyserial has a part for each system, and loads this system's.
HIDDEN = "import sys, serial.tools.list_ports; sys.modules.update(dict.fromkeys(('termios', 'fcntl', 'pty', 'tty')))"
IMPORT_ALL = """
import importlib, pathlib
for package in ("aero", "firmware_emulator", "simulator", "model", "hil"):
    for path in sorted(pathlib.Path(package).rglob("*.py")):
        name = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
        if name.endswith("__main__"):
            continue
        try:
            importlib.import_module(name)
        except ImportError as error:
            assert error.name not in ("termios", "fcntl", "pty", "tty"), error
"""


def run(program, cwd=ROOT):
    return subprocess.run(
        [sys.executable, "-c", f"{HIDDEN}\n{program}"], cwd=cwd, capture_output=True, text=True, check=False
    )


def command(*arguments):
    return f"from hil.cli import main; main({list(arguments)!r})"


def test_every_module_is_imported():
    done = run(IMPORT_ALL)
    assert done.returncode == 0, done.stderr


def test_an_emulated_hand_is_validated(tmp_path):
    done = run(command("validate", "--only", "presence", "--out", str(tmp_path / "out")))
    assert done.returncode == 0, done.stderr


def test_a_port_that_is_not_there_is_named():
    done = run(command("validate", "--hil", "COM97", "--only", "presence"))
    assert done.returncode == 3, done.stderr
    assert "COM97" in done.stderr


def test_serving_on_a_terminal_says_that_there_is_none():
    done = run(command("emulate"))
    assert done.returncode in (2, 5), done.stderr
    assert done.stderr.splitlines()[-1].startswith("Error: this system has no pseudo-terminals; serve on a serial port")
