"""The Python of README and docs runs as it is written, on an emulated hand where it names a port."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from pages import environment

from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.pty_process import serve_in_child

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
FRAMEWORKS = ("import torch", "runner.")
"""How snippets begin that export from a framework that no environment of ours has."""
SNIPPETS = [
    pytest.param(block, id=f"{page.stem}-{number}")
    for page in PAGES
    for number, block in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S))
    # tests/docs runs the tutorial's, in its place between the commands; lerobot_robot_aero/tests what needs LeRobot.
    if page.stem not in ("tutorial", "lerobot") and not block.startswith(FRAMEWORKS)
]


@pytest.fixture(scope="module")
def port():
    with serve_in_child(EmulatedSpec()) as (path, _):
        yield path


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_a_snippet_runs(snippet, port, tmp_path):
    name = re.match(r"# (test_\w+\.py)", snippet)
    path = tmp_path / (name.group(1) if name else "snippet.py")
    path.write_text(snippet.replace("/dev/ttyACM0", port), encoding="utf-8")
    runner = ["-m", "pytest", "-q", "-p", "no:cacheprovider"] if name else []
    ran = subprocess.run(
        [sys.executable, *runner, str(path)],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout[-2000:] + ran.stderr[-2000:]
