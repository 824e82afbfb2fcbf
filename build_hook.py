"""What is added to what is built: the commit, and, where it is asked for, the emulated hand's inner modules compiled.

Recordings of an installed project would otherwise not know what they were made with. With `AERO_HIL_COMPILED=1` a wheel
also holds the modules that `pyproject.toml` lists, compiled by mypyc; Python prefers them to the source beside them.
Without it, and in every sdist and editable install, nothing is compiled and no compiler is needed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TARGETS = ("wheel", "sdist")
"""A wheel that is built from an sdist takes the commit from there."""
COMMIT = "hil/recordings/commit.txt"
COMPILED = "AERO_HIL_COMPILED"
"""Environment variable that asks for a compiled wheel with `1`."""


class BuildHook(BuildHookInterface[Any]):
    """Add `hil/recordings/commit.txt` to what is built in a checkout, and compiled modules to a wheel."""

    def dependencies(self) -> list[str]:
        """Return what compiling needs, nothing for a pure wheel."""
        return list(self.config["compile-with"]) if self._compiles() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Leave the commit out where Git does not know it, and in an editable install, which asks Git itself."""
        if version == "editable" or self.target_name not in TARGETS:
            return
        commit = commit_of(Path(self.root))
        if commit is not None:
            path = Path(tempfile.mkdtemp()) / "commit.txt"
            path.write_text(commit, encoding="utf-8")
            build_data["force_include"][str(path)] = COMMIT
        if self._compiles():
            folder = compiled(Path(self.root), self.config["compiled"])
            build_data["force_include"].update({str(path): str(path.relative_to(folder)) for path in libraries(folder)})
            build_data["infer_tag"], build_data["pure_python"] = True, False

    def _compiles(self) -> bool:
        return self.target_name == "wheel" and os.environ.get(COMPILED) == "1"


def commit_of(root: Path) -> str | None:
    """Return the commit of a checkout as `git describe` says it, None where there is no Git."""
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--abbrev=12", "--dirty=+changes", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return None


def compiled(root: Path, modules: list[str]) -> Path:
    """Return a folder in which copies of `modules` (paths from `root`) stand compiled; the checkout stays as it is.

    Raises:
        RuntimeError: mypyc or the C compiler failed; the text is what they said.
    """
    folder = Path(tempfile.mkdtemp())
    for package in {Path(module).parts[0] for module in modules}:
        shutil.copytree(root / package, folder / package, ignore=shutil.ignore_patterns("*.so", "*.pyd", "__pycache__"))
    # The types are checked elsewhere, with the libraries that are imported; here they only have to be readable.
    command = [sys.executable, "-m", "mypyc", "--ignore-missing-imports", "--follow-imports=silent", *modules]
    run = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if run.returncode:
        raise RuntimeError(f"compiling failed:\n{run.stdout}")
    shutil.rmtree(folder / "build")
    return folder


def libraries(folder: Path) -> list[Path]:
    """Return the compiled modules below a folder, and the library that they share."""
    return sorted(path for path in folder.rglob("*") if path.suffix in {".so", ".pyd"})
