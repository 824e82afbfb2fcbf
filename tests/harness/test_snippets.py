"""The Python of README and docs runs as it is written, on an emulated hand where it names a port."""

import json
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from pages import environment

from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.pty_process import serve_in_child

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
FRAMEWORKS = ("import torch", "runner.")
"""How snippets begin that export from a framework that no environment of ours has."""
SNIPPETS = {
    f"{page.stem}-{number}": block
    for page in PAGES
    for number, block in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S))
    # tests/docs runs the tutorial's, in its place between the commands; lerobot_robot_aero/tests what needs LeRobot.
    if page.stem not in ("tutorial", "lerobot") and not block.startswith(FRAMEWORKS)
}
TEXTS = list(SNIPPETS.values())


ALL = """
import json, runpy, sys, traceback

failed = {}
for path in sys.argv[1:]:
    try:
        runpy.run_path(path, run_name="__main__")
    except BaseException:
        failed[path] = traceback.format_exc()
with open("failed.json", "w") as file:
    json.dump(failed, file)
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """Run the snippets that are scripts in one process, the others by pytest in another; return folder and mistakes."""
    folder = tmp_path_factory.mktemp("snippets")
    scripts, tests = [], []
    with serve_in_child(EmulatedSpec()) as (port, _):
        for number, snippet in enumerate(TEXTS):
            named = re.match(r"# (test_\w+\.py)", snippet)
            path = folder / str(number) / (named.group(1) if named else "snippet.py")
            path.parent.mkdir()
            path.write_text(snippet.replace("/dev/ttyACM0", port), encoding="utf-8")
            (tests if named else scripts).append(str(path))
        run = partial(
            subprocess.run, cwd=folder, env=environment(), capture_output=True, text=True, timeout=300, check=False
        )
        done = run([sys.executable, "-c", ALL, *scripts])
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        failed = json.loads((folder / "failed.json").read_text())
        for path in tests:
            tested = run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", path])
            if tested.returncode:
                failed[path] = tested.stdout[-2000:] + tested.stderr[-2000:]
    return {int(Path(path).parent.name): said for path, said in failed.items()}


@pytest.mark.parametrize("number", range(len(SNIPPETS)), ids=list(SNIPPETS))
def test_a_snippet_runs(number, ran):
    assert ran.get(number, "") == ""
