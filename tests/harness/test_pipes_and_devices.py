"""A pipe is not waited on, and a device is not read until memory ends, where a file was expected."""

import os

import pytest
from damaged_files import READERS, write_small_recording

from hil.recordings.mcap_file import read_recording


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="a system without pipes in its folders")
@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_a_pipe_is_refused(reader, tmp_path):
    os.mkfifo(tmp_path / reader.name)
    with pytest.raises((reader.declared, OSError), match=str(tmp_path)):
        reader.read(tmp_path / reader.name)


def test_a_link_to_a_file_is_read(tmp_path):
    write_small_recording(tmp_path / "a.mcap")
    (tmp_path / "b.mcap").symlink_to(tmp_path / "a.mcap")
    assert read_recording(tmp_path / "b.mcap") == read_recording(tmp_path / "a.mcap")
