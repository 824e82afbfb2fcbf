"""A pipe is not waited on, and a device is not read until memory ends, where a file was expected."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from damaged_files import READERS, write_small_recording

from hil.cli import main
from hil.recordings.mcap_file import read_recording

SECONDS = 60
"""Far more than a refusal takes, and less than for ever."""
READ = """
import resource, sys
resource.setrlimit(resource.RLIMIT_DATA, (3 * 2**30, 3 * 2**30))
sys.path.insert(0, {support!r})
from damaged_files import READERS
from pathlib import Path
reader = next(reader for reader in READERS if reader.name == {name!r})
try:
    reader.read(Path({path!r}))
except (reader.declared, OSError) as error:
    print("refused:", error)
"""
SUPPORT = str(Path(__file__).parents[1] / "support")


def pipe(path):
    os.mkfifo(path)


def zeros(path):
    path.symlink_to("/dev/zero")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="a system without pipes in its folders")
@pytest.mark.parametrize("what", [pipe, zeros])
@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_it_is_refused(reader, what, tmp_path):
    path = tmp_path / reader.name
    what(path)
    script = READ.format(support=SUPPORT, name=reader.name, path=str(path))
    ran = subprocess.run(
        [sys.executable, "-c", script], timeout=SECONDS, capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    assert ran.stdout.startswith("refused:"), ran.stderr[-2000:]
    assert str(tmp_path) in ran.stdout


def test_a_posture_is_not_read_for_ever(tmp_path):
    zeros(tmp_path / "posture.json")
    result = CliRunner().invoke(main, ["map", "--from", "compact", "--to", "codes", str(tmp_path / "posture.json")])
    assert result.exit_code == 2
    assert "more than 1048576 characters" in result.output


def test_a_link_to_a_file_is_read(tmp_path):
    write_small_recording(tmp_path / "a.mcap")
    (tmp_path / "b.mcap").symlink_to(tmp_path / "a.mcap")
    assert read_recording(tmp_path / "b.mcap") == read_recording(tmp_path / "a.mcap")
