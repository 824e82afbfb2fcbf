"""`aero-hil firmware compare --write`: a comparison that fails leaves the file that was there."""

import pytest
from click.testing import CliRunner

from hil.cli import main


@pytest.mark.parametrize("second", ["9.9", "damaged.jsonl"])
def test_a_comparison_that_fails_leaves_the_old_file(tmp_path, monkeypatch, second):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kept.jsonl.xz").write_text("good")
    (tmp_path / "damaged.jsonl").write_text("{}")
    done = CliRunner().invoke(main, ["firmware", "compare", "0.2.0", second, "--write", "kept.jsonl.xz"])
    assert done.exit_code == 2, done.output
    assert (tmp_path / "kept.jsonl.xz").read_text() == "good"
