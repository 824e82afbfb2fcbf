"""The commands of the README's owner section, and how they are run in a test."""

import os
import re
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

from only_extras import hiding_others

ROOT = Path(__file__).parents[2]
PORT = "/dev/ttyACM0"
SHORTER = {
    "aero-hil validate": "--only presence --only audit",
    "aero-hil record": "--excite steps --channel index --scale 0.4",
    "aero-hil run-policy": "--seconds 3 --record run.mcap",
}
"""Command to what is added to it here."""
LIMIT_S = 600


def owner_commands():
    """The commands of the README's owner section, without its installation and without the server."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    block = re.search(r"## Targets.*?```sh\n(.*?)```", text, re.S).group(1)
    lines = [line.partition("#")[0].strip() for line in block.splitlines()]
    commands = [part.strip() for line in lines for part in line.split("&&")]
    return [command for command in commands if command and not command.startswith(("pip ", "aero-hil emulate"))]


def with_a_twin(command):
    """Whether a command makes or uses `mine`, the recording of a hand and its twin."""
    return "mine" in command


def as_run(command, port):
    """A command as it is run here: on the served port, shortened, with the suite of the checkout."""
    command = command.replace(PORT, port).replace("tests/hil", str(ROOT / "tests" / "hil"))
    added = next((more for start, more in SHORTER.items() if command.startswith(start)), "")
    return shlex.split(f"{command} {added}")


@cache
def scripts():
    """The environment's own programs first, as in an activated one with the extras that the README names."""
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return os.environ | {"PATH": programs} | hiding_others(Path(mkdtemp()), "aero-hil[hil,suite]")


def run(command, folder):
    return subprocess.run(
        command, cwd=folder, env=scripts(), capture_output=True, text=True, timeout=LIMIT_S, check=False
    )
