"""Provenance of a recording: time, host, operator, command line, versions and commit."""

import getpass
import importlib.metadata
import os
import platform
import shlex
import subprocess
import sys
from datetime import datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any

LIBRARIES = ("aero-hil", "numpy", "mujoco", "pyserial")
COMMIT_FILE = Path(__file__).with_name("commit.txt")
"""Commit file of a wheel, written at build time because a wheel has no Git history."""
OPERATOR = "AERO_OPERATOR"
"""Environment variable for the operator's name, if other than the login name."""


def origin() -> dict[str, Any]:
    """Return the header fields on this program and its computer."""
    program = {"versions": versions(), "commit": source_commit(), "command": command_line()}
    return program | {"started": local_time(), "host": host(), "operator": operator()}


def local_time(ago_s: float = 0.0) -> str:
    """Return the date and time `ago_s` seconds ago, ISO 8601 with milliseconds and zone."""
    return (datetime.now().astimezone() - timedelta(seconds=ago_s)).isoformat(timespec="milliseconds")


def host() -> str:
    """Return the name of this computer."""
    return platform.node()


def _utf8(text: str) -> str:
    """Return text of the operating system with escapes in place of invalid UTF-8 bytes."""
    return text.encode(errors="backslashreplace").decode()


def command_line() -> str:
    """Return the command line of this program, quoted for a shell."""
    return _utf8(shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]))


def operator() -> str:
    """Return the operator of this program; empty if unknown."""
    try:
        return _utf8(os.environ.get(OPERATOR) or getpass.getuser())
    except (OSError, KeyError):  # no such user, as in some containers
        return ""


def versions(*more: str) -> dict[str, str]:
    """Return the versions of Python, of the installed libraries that results depend on, and of `more`."""
    return {"python": platform.python_version()} | {name: _version(name) for name in (*LIBRARIES, *more)}


@cache
def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


@cache
def source_commit() -> str:
    """Return the commit of this source tree, with `+changes` for an edited tree; empty if unknown."""
    if COMMIT_FILE.exists():
        return COMMIT_FILE.read_text(encoding="utf-8").strip()
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return ""
    try:
        # In a Git hook, GIT_* variables name the user's repository, and git would describe that one.
        ours = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
        out = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--abbrev=12", "--dirty=+changes", "--exclude=*"],
            capture_output=True,
            text=True,
            check=True,
            env=ours,
        )
    except (OSError, subprocess.CalledProcessError):
        return ""  # git is not installed, or refuses to read the checkout
    return out.stdout.strip()
