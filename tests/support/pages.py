"""What stands in code blocks of the documentation, and what its commands print."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT_S = 300


def blocks(page, language):
    """The code blocks of a page in one language, without their fences."""
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.S | re.M)


def steps(page):
    """The commands of a page with the lines that it shows below them, in order: [(command, [line])]."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = []
    for shell, shown in re.findall(r"^```sh\n(.*?)^```(?:\n```text\n(.*?)^```)?", text, re.S | re.M):
        commands = [line.partition("  #")[0].strip() for line in shell.splitlines()]
        found += [(command, []) for command in commands if command]
        found[-1] = (found[-1][0], shown.splitlines())
    return found


def missing(shown, printed):
    """The lines that a page shows and a command did not print; `…` stands for anything, white space for white space."""
    said = " ".join(printed.split())
    patterns = {line: ".*?".join(map(re.escape, " ".join(line.split()).split("…"))) for line in shown}
    return [line for line, pattern in patterns.items() if not re.search(pattern, said)]


def environment():
    """This interpreter's own programs first, as in an activated environment; a wide terminal."""
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return os.environ | {"PATH": programs, "COLUMNS": "200"}


def run(command, folder):
    """Run a shell command in a folder; its output and errors together are `stdout`."""
    return subprocess.run(
        command, shell=True, cwd=folder, env=environment(), text=True, timeout=LIMIT_S, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
