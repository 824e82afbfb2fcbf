"""What is built carries its commit."""

import os
import shutil
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[2]
BUILT = ("pyproject.toml", "build_hook.py", "README.md", "LICENSE", "NOTICE")
PLACE = "hil/recordings/commit.txt"

# `tox` hides the machine's programs; the one that made the checkout is asked all the same.
GIT = shutil.which("git") or shutil.which("git", path=os.defpath)

pytestmark = pytest.mark.skipif(GIT is None, reason="no git on this machine")


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A small checkout that is built as this one."""
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "git").symlink_to(GIT)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    folder = tmp_path / "checkout"
    folder.mkdir()
    for name in BUILT:
        shutil.copy(ROOT / name, folder)
    for package in ("aero", "firmware_emulator", "simulator", "model", "hil/recordings", "train"):
        (folder / package).mkdir(parents=True)
        (folder / package / "__init__.py").touch()
    identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
    for command in (["init", "-q"], ["add", "-A"], [*identity, "commit", "-q", "-m", "a"]):
        subprocess.run(["git", *command], cwd=folder, check=True)
    return folder


def commit_of(folder):
    said = subprocess.run(["git", "rev-parse", "HEAD"], cwd=folder, capture_output=True, text=True, check=True)
    return said.stdout.strip()[:12]


def built(builder, folder, out):
    return Path(next(builder(str(folder)).build(directory=str(out), versions=["standard"])))


def in_wheel(path):
    with zipfile.ZipFile(path) as archive:
        return archive.read(PLACE).decode().strip()


def test_a_wheel_knows_its_commit(checkout, tmp_path):
    assert in_wheel(built(WheelBuilder, checkout, tmp_path / "out")) == commit_of(checkout)


def test_an_sdist_and_the_wheel_that_is_built_from_it_know_their_commit(checkout, tmp_path):
    sdist = built(SdistBuilder, checkout, tmp_path / "out")
    with tarfile.open(sdist) as archive:
        # Python 3.11.2 has no extraction filters; 3.12 warns without one.
        archive.extraction_filter = getattr(tarfile, "data_filter", None)
        archive.extractall(tmp_path / "unpacked")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    assert (unpacked / PLACE).read_text().strip() == commit_of(checkout)
    assert not (unpacked / ".git").exists()
    assert in_wheel(built(WheelBuilder, unpacked, tmp_path / "again")) == commit_of(checkout)
