"""Code blocks of the documentation, and the expected output of their commands."""

import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT_S = 300
INSTALLATION = re.compile(r"(python3? -m venv|\. ~|pip install|python -m pip|git submodule|mkdir|cd )")


def blocks(page, language):
    """Return the code blocks of a page in one language, without their fences."""
    return re.findall(rf"^```{language}\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.S | re.M)


def steps(page):
    """Return the commands of a page in order with the output shown below each: [(command, [line])]."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = []
    for shell, shown in re.findall(r"^```sh\n(.*?)^```(?:\n```text\n(.*?)^```)?", text, re.S | re.M):
        commands = [line.partition("  #")[0].strip() for line in shell.splitlines()]
        found += [(command, []) for command in commands if command]
        found[-1] = (found[-1][0], shown.splitlines())
    return found


@dataclass(frozen=True)
class Typed:
    """Command of a page, with the installation that precedes it."""

    command: str
    installation: str
    """Arguments of `pip install`."""


HIL, SUITE = "-e '.[hil]'", "-e '.[suite]'"
"""Installations of the README for commands and for pytest; defaults of a page without an installation."""
INSTALLS = re.compile(r"^(?:.*`)?pip install (.+?)\s*(?:`|  #|$)", re.M)
PYTEST = re.compile(r"`(pytest (?:test_\w+\.py|tests/hil)[^`]*)`")
"""Inline pytest commands for users; all others are for contributors, who have `tox`."""
AERO_HIL = re.compile(r"`(aero-hil [^`]*)`")


def typed(page):
    """Return the distinct commands of a page in order, as `Typed`.

    An installation in a block applies to all later commands, one in a paragraph or a table row only to that.
    """
    prose, *rest = re.split(r"^```(\w*)\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), flags=re.S | re.M)
    found, installed = _inline(prose, ""), ""
    for language, block, prose in zip(*(iter(rest),) * 3, strict=True):
        if language in ("", "sh"):
            installed = (INSTALLS.findall(block) or [installed])[-1]
        if language == "sh":
            found += [Typed(command, installed or HIL) for command in commands(block)]
        found += _inline(prose, installed)
    return list(dict.fromkeys(found))


def _inline(prose, installed):
    """Return the inline commands of some paragraphs and tables, after an installation."""
    found = []
    for part in re.split(r"\n\n|\n(?=\|)", prose):
        text = " ".join(part.split())
        own = INSTALLS.findall(text)
        names = [*PYTEST.findall(text), *(AERO_HIL.findall(text) if own else ())]
        found += [Typed(name, (own or [installed or SUITE])[-1]) for name in names]
    return found


def commands(block):
    """Return the commands of a shell block, without comments and installation; a loop is one command."""
    lines = re.sub(r"\\\n\s*", " ", block).splitlines()
    if any(line.startswith("for ") for line in lines):
        return [block]
    found = [line.partition("  #")[0].strip() for line in lines if not line.startswith("#")]
    return [command for command in found if command and not INSTALLATION.match(command)]


def missing(shown, printed):
    """Return the lines of a page that a command did not print; `…` matches any text, white space any white space."""
    said = " ".join(printed.split())
    patterns = {line: ".*?".join(map(re.escape, " ".join(line.split()).split("…"))) for line in shown}
    return [line for line, pattern in patterns.items() if not re.search(pattern, said)]


def environment():
    """Return variables with this interpreter's programs first, as in an activated environment, and a wide terminal."""
    programs = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return os.environ | {"PATH": programs, "COLUMNS": "200"}
