"""Results replace a link in their place and never write through it; a result that fails leaves the old one."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from damaged_files import write_policy, write_small_recording

from aero.whole_file import begin_file, whole, write_whole
from hil.cli import main
from hil.lab.campaign.store import opened
from hil.recordings.mcap_file import read_recording, write_recording

ROOT = Path(__file__).parents[2]
ITS_OWN_WAY = {
    "aero/whole_file.py": "the way",
    "firmware_emulator/firmware/nvs.py": "may import nothing of ours",
    "firmware_emulator/native/compilers.py": "into a temporary folder",
    "firmware_emulator/native/sketch.py": "into a temporary folder",
    "hil/lab/endurance.py": "adds to a log",
    "train/progress.py": "adds to a log",
}


def test_nothing_else_opens_a_file_for_writing():
    packages = ("aero", "firmware_emulator", "hil", "model", "train")
    writes = re.compile(r"write_text\(|write_bytes\(|open\(\"[wxa]b?\"|\.save(fig)?\(path\b")
    found = {
        str(path.relative_to(ROOT))
        for package in packages
        for path in (ROOT / package).rglob("*.py")
        if writes.search(path.read_text().replace('draft.open("xb")', "").replace('draft.open("x"', ""))
    }
    assert found <= ITS_OWN_WAY.keys()


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


@pytest.mark.parametrize(
    ("line", "outputs"),
    [
        ("campaign --healthy 1 --only presence --workers 1 --out C", ("C/campaign.html",)),
        ("record --excite steps --channel index --scale 0.1 --out r.mcap", ("r.mcap",)),
        ("run-policy --seconds 0.1 --wait 0 --empty --record r.mcap", ("r.mcap",)),
        ("identify --out I", ("I/coefficients.toml",)),
    ],
)
def test_results_of_commands_replace_links(line, outputs, victim, place):
    for output in outputs:
        path = place / output
        path.parent.mkdir(exist_ok=True)
        path.unlink(missing_ok=True)
        path.symlink_to(victim)
    result = CliRunner().invoke(main, line.split())
    assert result.exit_code == 0, result.output
    for output in outputs:
        assert not (place / output).is_symlink()
        assert (place / output).stat().st_size > 4


def test_limits_replace_links(victim, place, monkeypatch):
    """One hand is too few for limits."""
    for name in ("computed_limits", "own_limits", "require_enough"):
        monkeypatch.setattr(f"hil.cli.limits.{name}", lambda *given: ())
    (place / "L").mkdir()
    (place / "L" / "aero_hand_open.toml").symlink_to(victim)
    result = CliRunner().invoke(main, ["limits", "C", "--out", "L"])
    assert result.exit_code == 0, result.output
    assert not (place / "L" / "aero_hand_open.toml").is_symlink()


@pytest.fixture
def place(tmp_path, monkeypatch, campaign):
    """A folder to be in, with that campaign as C."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "C").symlink_to(campaign)
    return tmp_path


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A campaign of one healthy hand."""
    folder = tmp_path_factory.mktemp("campaign")
    line = f"campaign --healthy 1 --only presence --workers 1 --out {folder}"
    result = CliRunner().invoke(main, line.split())
    assert result.exit_code == 0, result.output
    with opened(folder, read_only=True) as store:
        assert len(store.keys()) == 1
    return folder


def test_what_fails_leaves_the_old_one(tmp_path):
    path = tmp_path / "x.txt"
    write_whole(path, "old")
    with pytest.raises(FileNotFoundError), whole(path) as draft:
        draft.with_name("none").replace(draft)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_neither_a_file_nor_a_link_is_not_replaced(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    with pytest.raises(OSError, match="no regular file"):
        begin_file(folder)
    assert folder.is_dir()
