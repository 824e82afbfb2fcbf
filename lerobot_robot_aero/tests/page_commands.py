"""LeRobot's commands as lerobot_robot_aero/lerobot.md shows them, for the tests and for the figures of the page."""

import os
import re
import shlex
import subprocess
import sysconfig
from pathlib import Path

PAGE = Path(__file__).parents[1] / "lerobot.md"
OPENED = "stopped and opened slowly. The program ended."
"""What the guard logs of a hand that it has left open."""
PATIENCE_S = 240.0
"""Of one command; LeRobot alone takes 15 s to start on a machine with two cores."""


def shown(name: str) -> list[str]:
    """Return the options of a command as the page shows it, with an emulated hand on each port."""
    page = PAGE.read_text(encoding="utf-8").replace("\\\n", "").replace("/dev/ttyACM0", "emulated")
    line = re.search(rf"^{name} (.*)$", page, re.M)
    assert line is not None, f"{PAGE} shows no {name}"
    return shlex.split(line.group(1))


def begun(name: str, folder: Path, *changed: str) -> subprocess.Popen[str]:
    """Begin a command of the page, with options changed, in a folder."""
    environment = os.environ | {"HF_HUB_OFFLINE": "1", "HF_HOME": str(folder / "home")}
    program = Path(sysconfig.get_path("scripts")) / name
    return subprocess.Popen(
        [program, *shown(name), *changed],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def done(process: subprocess.Popen[str], patience_s: float = PATIENCE_S) -> str:
    """Wait for a command to end well, and return what it said."""
    try:
        said, _ = process.communicate(timeout=patience_s)
    finally:
        process.kill()
    assert process.returncode == 0, said[-4000:]
    return said


def wait_for(process: subprocess.Popen[str], text: str) -> None:
    """Read what a command says up to a line with a text."""
    assert process.stdout is not None
    said = []
    for line in process.stdout:
        said.append(line)
        if text in line:
            return
    raise AssertionError(f"{text!r} was not said: {''.join(said)[-4000:]}")
