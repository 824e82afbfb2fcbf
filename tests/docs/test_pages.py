"""Every command of README and docs runs as it is pasted, in the order of its page, on emulated hands.

Each runs in an environment of its own, with what its page says to install. `tox -e realtime` runs them, because a hand
on a port takes its time.
"""

import re
import shutil
from contextlib import ExitStack
from importlib import resources
from pathlib import Path

import pytest
import yaml
from extras import activated
from own_policies import write_onnx
from pages import ROOT, SUITE, blocks, typed
from terminal import Terminal

from hil.recordings.mcap_file import read_recording

pytestmark = pytest.mark.slow
ELSEWHERE = {
    "tutorial": "tests/docs/test_first_hour.py, with its output",
    "firmware": "tests/firmware, with a firmware of our own",
}
PAGES = sorted(
    str(path.relative_to(ROOT))
    for path in (ROOT / "README.md", *(ROOT / "docs").rglob("*.md"))
    if path.stem not in ELSEWHERE and typed(path)
)
CODES = {"validate --fault": {1}, "aero-hil diagnose": {1}, "validate --unit m": {0, 1}}
"""Exit codes of commands; a twin of the short recordings that are made here may be out of limits."""
NEEDS_A_SCREEN = "MUJOCO_GL="
NEEDS_A_CHECKPOINT = "aero-hil convert-policy"
TAKES_HOURS = "aero-hil train"
ASKS_A_PERSON = "aero-hil setup"  # answered in tests/harness/cli/test_setup.py


@pytest.fixture
def terminal(tmp_path, installed):
    """A terminal with the files that readers of a page have."""
    shipped = next(path for path in resources.files("aero.policy.shipped").iterdir() if path.name.endswith(".npz"))
    shutil.copy(shipped, tmp_path / "mine.npz")
    shutil.copy(ROOT / "model/units/reference.toml", tmp_path / "my_hand.toml")
    write_onnx(tmp_path)
    with ExitStack() as stack:
        yield Terminal(tmp_path, stack, installed(SUITE))


def write_snippets(page, folder):
    """Write the files whose names a page's code begins with."""
    for snippet in blocks(page, "python"):
        if named := re.match(r"# (test_\w+\.py)", snippet):
            (folder / named.group(1)).write_text(snippet, encoding="utf-8")


@pytest.mark.parametrize("page", PAGES)
def test_every_command_runs_as_it_is_pasted(page, terminal, installed, tmp_path):
    write_snippets(page, tmp_path)
    for typed_in in typed(page):
        if not typed_in.command.startswith((NEEDS_A_SCREEN, NEEDS_A_CHECKPOINT, TAKES_HOURS, ASKS_A_PERSON)):
            terminal.variables = activated(installed(typed_in.installation))
            codes = next((codes for part, codes in CODES.items() if part in typed_in.command), {0})
            terminal.type(typed_in.command, codes=codes)
    if page == "README.md":
        session = tmp_path / "validation" / "latest" / "session.mcap"
        assert read_recording(session).header.started


def test_the_workflow_for_ones_own_repository(terminal, installed, tmp_path):
    workflow = yaml.safe_load(blocks("docs/test_your_driver.md", "yaml")[0])
    lines = [step["run"] for step in workflow["jobs"]["hand"]["steps"] if "run" in step]
    (tmp_path / "tests").mkdir()
    write_snippets("docs/test_your_driver.md", tmp_path / "tests")
    assert [line.split()[0] for line in lines] == ["pip", "aero-hil", "pytest"]
    terminal.variables = activated(installed(lines[0].removeprefix("pip install ").replace("./aero-hil", str(ROOT))))
    for line in lines[1:]:
        terminal.type(line)
    assert {"report.html", "junit.xml"} <= {path.name for path in (tmp_path / "hand-report").iterdir()}


def test_a_page_that_is_tested_elsewhere_exists():
    assert all((Path(ROOT) / "docs" / f"{name}.md").exists() for name in ELSEWHERE)
