"""Results replace a link in their place and never write through it; a result that fails leaves the old one."""

import errno
from functools import partial
from pathlib import Path

import pytest
from damaged_files import write_policy, write_small_recording

from aero.whole_file import begin_file, whole, write_whole
from hil.recordings.mcap_file import read_recording, write_recording


@pytest.fixture
def victim(tmp_path):
    """What a link in place of a result points at; it has to stay as it is."""
    path = tmp_path / "victim"
    path.write_text("kept")
    yield path
    assert path.read_text() == "kept"


def test_a_recording_replaces_a_link(victim, tmp_path):
    write_small_recording(tmp_path / "good.mcap")
    (tmp_path / "link.mcap").symlink_to(victim)
    write_recording(read_recording(tmp_path / "good.mcap"), tmp_path / "link.mcap")
    assert not (tmp_path / "link.mcap").is_symlink()
    assert read_recording(tmp_path / "link.mcap") == read_recording(tmp_path / "good.mcap")


def test_a_policy_replaces_a_link(victim, tmp_path):
    (tmp_path / "link.npz").symlink_to(victim)
    write_policy(tmp_path / "link.npz")
    assert not (tmp_path / "link.npz").is_symlink()


def test_what_fails_leaves_the_old_one(tmp_path):
    path = tmp_path / "x.txt"
    write_whole(path, "old")
    with pytest.raises(FileNotFoundError), whole(path) as draft:
        draft.with_name("none").replace(draft)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.fixture
def mounted(tmp_path, monkeypatch):
    """A file that is a mount of its own, as `docker -v file:file` makes it."""
    path = tmp_path / "mounted.txt"
    path.write_text("old and longer")
    inode = path.stat().st_ino
    busy = OSError(errno.EBUSY, "Device or resource busy")

    def refuse(self, *others):
        if path in (self, *others):
            raise busy
        return real[len(others)](self, *others)

    real = {0: partial(Path.unlink, missing_ok=True), 1: Path.replace}
    monkeypatch.setattr(Path, "unlink", lambda self, missing_ok=False: refuse(self))
    monkeypatch.setattr(Path, "replace", refuse)
    yield path
    assert path.stat().st_ino == inode


def test_a_file_that_is_mounted_is_overwritten(mounted):
    write_whole(mounted, "new")
    assert mounted.read_text() == "new"
    assert [path.name for path in mounted.parent.iterdir()] == [mounted.name]


def test_a_recording_goes_into_a_file_that_is_mounted(mounted):
    with begin_file(mounted) as stream:
        stream.write(b"new")
    assert mounted.read_text() == "new"


def test_what_is_neither_a_file_nor_a_link_is_not_replaced(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    with pytest.raises(OSError, match="not a regular file"):
        begin_file(folder)
    assert folder.is_dir()
