"""A full disk is said as what it is, with the exit code for it, and leaves nothing that looks like a result."""

import pytest
from click.testing import CliRunner
from full_disk import available, full_disk

from hil.cli import main
from hil.recordings.mcap_file import read_recording

pytestmark = pytest.mark.skipif(not available, reason="needs a limit on the size of files")

WHOLE_OR_NOTHING = (
    "report GOOD/presence.mcap --out NEW/r.html",
    "export GOOD/presence.mcap --out NEW/x.mcap",
    "baseline GOOD NEW/base",
)
"""Commands whose result is there when all went well."""
AS_FAR_AS_IT_WENT = (
    "record --excite steps --channel index --scale 0.1 --out NEW/r.mcap",
    "validate --only presence --out NEW",
    "run-policy --seconds 0.1 --wait 0 --empty --record NEW/r.mcap",
)
"""Commands whose recordings hold what was written."""


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Results of a validation."""
    folder = tmp_path_factory.mktemp("good") / "results"
    assert CliRunner().invoke(main, f"validate --only presence --out {folder}".split()).exit_code == 0
    return folder


def run(line, good, new):
    """Run a command; return what it said, after what has to hold for every one."""
    ended = CliRunner().invoke(main, line.replace("GOOD", str(good)).replace("NEW", str(new)).split())
    assert ended.exit_code == 5, ended.output
    assert "Traceback" not in ended.output
    for word in ("supply", "servo", "cable", "within limits", "out of limits"):
        assert f"likely {word}" not in ended.output
    return ended.output.splitlines()[-1]


@pytest.mark.parametrize("size", [0, 4096, 6000])
@pytest.mark.parametrize("line", WHOLE_OR_NOTHING)
def test_nothing_is_left_of_a_result(line, size, good, tmp_path):
    with full_disk(size):
        said = run(line, good, tmp_path / "new")
    assert str(tmp_path / "new") in said
    assert [path for path in (tmp_path / "new").rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("size", [0, 4096, 6000])
@pytest.mark.parametrize("line", AS_FAR_AS_IT_WENT)
def test_a_recording_holds_what_was_written(line, size, good, tmp_path):
    with full_disk(size):
        run(line, good, tmp_path / "new")
    for path in (tmp_path / "new").rglob("*.mcap"):
        assert not read_recording(path).header.finished
