"""Environments with exactly the packages of a page's `pip install`."""

import fcntl
import os
import re
import shlex
import subprocess
import sys

from pages import ROOT


def programs_of(installation, folder):
    """Return the folder of programs of a fresh environment after `pip install` with these arguments.

    Each environment is created once in `folder`, by the first test process that needs it.
    """
    environment = folder / re.sub(r"\W+", "-", installation).strip("-")
    with environment.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (environment / "whole").exists():
            _uv("venv", "--python", sys.executable, str(environment))
            _uv("pip", "install", "--python", str(environment / "bin" / "python"), *shlex.split(installation))
            (environment / "whole").touch()
    return environment / "bin"


def _uv(*words):
    command = [sys.executable, "-m", "uv", *words]
    ran = subprocess.run(command, cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    assert ran.returncode == 0, f"{command}\n{ran.stdout}"
    # For an extra that does not exist pip and uv only warn.
    assert "does not have an extra" not in ran.stdout, ran.stdout


def activated(programs):
    """Return the variables of a shell with an activated environment and a wide terminal, without those of this
    process."""
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    return kept | {"PATH": os.pathsep.join((str(programs), os.defpath)), "COLUMNS": "200"}
