"""Table of docs/lerobot.md, from a run of the page's commands in real time."""

from __future__ import annotations

from figures.stored import plain, stored

TABLES = {"commands": stored("lerobot", plain)}
"""What LeRobot's commands do on an emulated hand."""
