"""Add the commit to what is built, so that recordings of an installed project know what they were made with."""

import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TARGETS = ("wheel", "sdist")
"""A wheel that is built from an sdist takes the commit from there."""
COMMIT = "hil/recordings/commit.txt"


class BuildHook(BuildHookInterface[Any]):
    """Add `hil/recordings/commit.txt` to what is built in a checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Leave the commit out where Git does not know it, and in an editable install, which asks Git itself."""
        if version == "editable" or self.target_name not in TARGETS:
            return
        commit = commit_of(Path(self.root))
        if commit is not None:
            path = Path(tempfile.mkdtemp()) / "commit.txt"
            path.write_text(commit, encoding="utf-8")
            build_data["force_include"][str(path)] = COMMIT


def commit_of(root: Path) -> str | None:
    """Return the commit of a checkout as `git describe` says it, None where there is no Git."""
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--abbrev=12", "--dirty=+changes", "--exclude=*"]
    # In a Git hook these name another repository.
    ours = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, env=ours).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
