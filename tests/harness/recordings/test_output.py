"""Where results go: folders that two runs never share, names that are no UTF-8, a commit that is ours."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from aero.whole_file import write_whole
from hil.recordings import provenance
from hil.recordings.errors import UnwritablePlaceError
from hil.recordings.output import claimed, run_folder

GIT = shutil.which("git") or shutil.which("git", path=os.defpath)


def test_runs_that_start_in_one_second_never_share_a_folder(tmp_path):
    with ThreadPoolExecutor(8) as pool:
        folders = list(pool.map(lambda _: run_folder(tmp_path), range(40)))
    assert len(set(folders)) == 40


@pytest.mark.skipif(sys.platform == "win32", reason="Windows locks no folders")
def test_a_folder_into_which_a_run_writes_takes_no_other_run(tmp_path):
    refused = pytest.raises(UnwritablePlaceError, match="another run writes there")
    with claimed(tmp_path), refused, claimed(tmp_path):
        pass
    with claimed(tmp_path):
        pass


@pytest.mark.skipif(GIT is None, reason="needs git")
def test_a_commit_is_ours_in_a_git_hook_of_another_repository(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(Path(GIT).parent), prepend=os.pathsep)
    provenance.source_commit.cache_clear()
    expected = provenance.source_commit()
    subprocess.run([GIT, "init", "-q", str(tmp_path)], check=True)
    monkeypatch.setenv("GIT_DIR", str(tmp_path / ".git"))
    monkeypatch.setenv("GIT_INDEX_FILE", str(tmp_path / "index"))
    provenance.source_commit.cache_clear()
    assert provenance.source_commit() == expected != ""


def test_names_that_are_no_utf8_are_written_with_escapes(tmp_path, monkeypatch):
    monkeypatch.setenv(provenance.OPERATOR, os.fsdecode(b"Ren\xe9"))
    monkeypatch.setattr(sys, "argv", ["aero-hil", "--out", os.fsdecode(b"caf\xe9")])
    assert provenance.operator() == "Ren\\udce9"
    assert provenance.command_line().encode()
    write_whole(tmp_path / "page.html", os.fsdecode(b"caf\xe9"))
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "caf\\udce9"
