"""Write the commit into wheel and sdist, whose recordings would otherwise not know what they were made with."""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

TARGETS = ("wheel", "sdist")
"""A wheel that is built from an sdist takes the file from there."""
PLACE = "hil/recordings/commit.txt"


class CommitHook(BuildHookInterface[Any]):
    """Add `hil/recordings/commit.txt` to what is built in a checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Ask Git; leave the file out where it does not know, and in an editable install, which asks Git itself."""
        if self.target_name not in TARGETS or version == "editable" or not (Path(self.root) / ".git").exists():
            return
        command = ["git", "-C", self.root, "describe", "--always", "--abbrev=12", "--dirty=+changes", "--exclude=*"]
        try:
            commit = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        except (OSError, subprocess.CalledProcessError):
            return
        path = Path(tempfile.mkdtemp()) / "commit.txt"
        path.write_text(commit, encoding="utf-8")
        build_data["force_include"][str(path)] = PLACE
