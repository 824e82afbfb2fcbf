"""Every shell block of README and docs runs as it is pasted, in the order of its page, on emulated hands.

`tox -e realtime` runs it, because a hand on a port takes its time.
"""

import re
import shutil
from contextlib import ExitStack
from importlib import resources
from pathlib import Path

import pytest
import yaml
from only_extras import hiding_others
from pages import ROOT, blocks
from terminal import Terminal, commands

from hil.recordings.mcap_file import read_recording

pytestmark = pytest.mark.slow
ELSEWHERE = {
    "tutorial": "tests/docs/test_first_hour.py, with its output",
    "firmware": "tests/firmware, with a firmware of our own",
}
PAGES = sorted(
    str(path.relative_to(ROOT))
    for path in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
    if path.stem not in ELSEWHERE and blocks(path, "sh")
)
CODES = {"validate --fault": {1}, "aero-hil diagnose": {1}, "validate --unit m": {0, 1}}
"""Exit codes of commands; a twin of the short recordings that are made here may be out of limits."""
NEEDS_A_SCREEN = "MUJOCO_GL="
NEEDS_A_CHECKPOINT = "aero-hil convert-policy"


@pytest.fixture
def terminal(tmp_path):
    """A terminal with the files that readers of a page have."""
    shipped = next(path for path in resources.files("aero.policy.shipped").iterdir() if path.name.endswith(".npz"))
    shutil.copy(shipped, tmp_path / "mine.npz")
    shutil.copy(ROOT / "model/units/reference.toml", tmp_path / "my_hand.toml")
    with ExitStack() as stack:
        yield Terminal(tmp_path, stack)


@pytest.mark.parametrize("page", PAGES)
def test_every_block_runs_as_it_is_pasted(page, terminal, tmp_path):
    if page == "README.md":
        terminal.variables |= hiding_others(tmp_path / "hidden", "aero-hil[hil]")
    for block in blocks(page, "sh"):
        for command in commands(block):
            if not command.startswith((NEEDS_A_SCREEN, NEEDS_A_CHECKPOINT)):
                terminal.type(command, codes=next((c for part, c in CODES.items() if part in command), {0}))
    if page == "README.md":
        session = tmp_path / "validation" / "latest" / "session.mcap"
        assert read_recording(session).header.started


def test_the_workflow_for_ones_own_repository(terminal, tmp_path):
    workflow = yaml.safe_load(blocks("docs/test_your_driver.md", "yaml")[0])
    lines = [step["run"] for step in workflow["jobs"]["hand"]["steps"] if "run" in step]
    (tmp_path / "tests").mkdir()
    for snippet in blocks("docs/test_your_driver.md", "python"):
        name = re.match(r"# (test_\w+\.py)", snippet).group(1)
        (tmp_path / "tests" / name).write_text(snippet, encoding="utf-8")
    assert [line.split()[0] for line in lines] == ["pip", "aero-hil", "pytest"]
    for line in lines[1:]:
        terminal.type(line)
    assert {"report.html", "junit.xml"} <= {path.name for path in (tmp_path / "hand-report").iterdir()}


def test_a_page_that_is_tested_elsewhere_exists():
    assert all((Path(ROOT) / "docs" / f"{name}.md").exists() for name in ELSEWHERE)
