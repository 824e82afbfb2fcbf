"""A bundle holds the run without the names of user, home folder and computer, and opens elsewhere."""

import getpass
import json
import platform
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from hil.cli import main, report
from hil.cli.doctor.finding import Examined, Verdict
from hil.recordings.mcap_file import _records, read_recording, write_recording
from hil.recordings.recording import Event, Header
from hil.report import bundle
from hil.report.bundle import scrubber, unpacked
from hil.report.run_folder import JUDGED_NAMES

USER, HOST = "quillfeather", "inkwell.example.org"
NAMES = (USER, "inkwell", "parchment")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Home folder of a user who validated a hand with a unit file and a baseline of that folder."""
    home = tmp_path_factory.mktemp("people") / USER
    home.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        be(patch, home)
        (home / "mine.toml").write_text("description = 'mine'\n")
        for name in ("known", "run"):
            options = ["--unit", str(home / "mine.toml"), "--only", "presence", "--fault", "cable_snapped:ring"]
            options += ["--only", "audit", "--out", str(home / name)]
            options += ["--baseline", str(home / "known")] if name == "run" else []
            patch.setattr(sys, "argv", ["aero-hil", "validate", *options])
            assert CliRunner().invoke(main, ["validate", *options]).exit_code == 1
    path = home / "run" / "audit.mcap"
    made = read_recording(path)
    told = (Event(1.0, "warning", f"{home}/twin.toml on parchment of {USER} is old"),)
    header = replace(made.header, operator="parchment")
    write_recording(replace(made, header=header, events=told), path)
    case = json.loads((home / "run" / "case.json").read_text())
    (home / "run" / "case.json").write_text(json.dumps(case | {"answers": {"cable": f"{USER} pulled it, it is torn"}}))
    return home


def be(patch, home, user=USER, host=HOST):
    """Be another user on another computer."""
    for name in ("USER", "LOGNAME", "USERNAME"):
        patch.setenv(name, user)
    patch.setenv("HOME", str(home))
    patch.setattr(platform, "node", lambda: host)
    assert getpass.getuser() == user


@pytest.fixture(scope="module")
def packed(place, tmp_path_factory):
    """The bundle, and what the command printed."""
    path = tmp_path_factory.mktemp("out") / "bundle.zip"
    with pytest.MonkeyPatch.context() as patch:
        be(patch, place)
        here = Examined("jitter", Verdict.OK, f"{USER}@inkwell", copy=(f"sudo adduser {USER} dialout",))
        patch.setattr(report, "examine", lambda: [here])
        done = CliRunner().invoke(
            main, ["report", str(place / "run"), "--bundle", str(path), "--out", str(path.with_suffix(".html"))]
        )
    return path, done


def everything(path):
    """Return all bytes of a bundle, unpacked, with those of the recordings' compressed chunks."""
    with ZipFile(path) as archive:
        for info in archive.infolist():
            yield repr(info).encode() + info.comment + info.extra
            yield archive.read(info)
            if info.filename.endswith(".mcap"):
                with archive.open(info) as stream, Path(path.parent, "member").open("w+b") as file:
                    shutil.copyfileobj(stream, file)
                    file.seek(0)
                    yield from (repr(record).encode() for record in _records(file))


def test_a_bundle_holds_no_name(packed, place):
    path, _ = packed
    held = b"\n".join(everything(path)).lower()
    assert b"audit" in held
    assert [name for name in (*NAMES, str(place)) if name.lower().encode() in held] == []


def test_the_run_itself_names_them(place):
    """Otherwise the test above shows nothing."""
    texts = b"".join(path.read_bytes() for path in (place / "run").glob("*.json"))
    header = read_recording(place / "run" / "presence.mcap").header
    assert str(place).encode() in texts
    assert (header.operator, header.host) == (USER, HOST)
    assert str(place) in header.command
    assert str(place) in header.unit


def test_the_size_is_printed_and_the_run_is_judged(packed):
    path, done = packed
    assert done.exit_code == 1, done.output
    assert f"{path}: {path.stat().st_size / 1e3:.0f} kB" in done.output.replace("\n", "")
    assert path.stat().st_size < 1e6


def test_a_bundle_has_recordings_checks_case_versions_and_what_doctor_found(packed):
    with ZipFile(packed[0]) as archive:
        about = json.loads(archive.read("bundle.json"))
        case = json.loads(archive.read("case.json"))
        assert {"presence.mcap", "audit.mcap", "session.mcap", "checks.json"} < set(archive.namelist())
    assert about["versions"].keys() >= {"python", "aero-hil", "numpy"}
    assert about["doctor"][0]["finding"] == "USER@COMPUTER"
    assert about["left_out"] == []
    assert case["answers"] == {"cable": "USER pulled it, it is torn"}


def test_a_bundle_opens_elsewhere_with_the_same_verdict(packed, place, tmp_path, monkeypatch):
    be(monkeypatch, tmp_path, "somebody", "elsewhere")
    monkeypatch.chdir(tmp_path)
    there = CliRunner().invoke(main, ["report", str(packed[0])])
    here = CliRunner().invoke(main, ["report", str(place / "run"), "--out", "here.html"])
    assert there.exit_code == here.exit_code == 1, there.output
    assert there.output.splitlines()[:-1] == here.output.splitlines()[:-1]
    assert "audit.mcap" not in Path("report.html").read_text()
    assert "audit.mcap" in Path("here.html").read_text()


def test_a_damaged_recording_is_left_out_with_its_reason(place, tmp_path, monkeypatch):
    monkeypatch.setattr(report, "examine", lambda: [])
    shutil.copytree(place / "run", tmp_path / "run")
    (tmp_path / "run" / "presence.mcap").write_bytes(b"damaged" * 100)
    done = CliRunner().invoke(
        main, ["report", str(tmp_path / "run"), "--bundle", str(tmp_path / "b.zip"), "--out", str(tmp_path / "r.html")]
    )
    assert "left out: " in done.output
    assert done.exit_code == 2
    with ZipFile(tmp_path / "b.zip") as archive:
        assert "audit.mcap" in archive.namelist()
        assert "presence.mcap" not in archive.namelist()


@pytest.mark.parametrize("given", ["two runs", "recording"])
def test_a_bundle_is_of_one_folder(place, tmp_path, given):
    run = [str(place / "run")]
    runs = run * 2 if given == "two runs" else [str(place / "run" / "audit.mcap")]
    done = CliRunner().invoke(main, ["report", *runs, "--bundle", str(tmp_path / "b.zip")])
    assert done.exit_code == 2
    assert "one run" in done.output
    assert not list(tmp_path.iterdir())


def zipped(path, **members):
    with ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)


@pytest.mark.parametrize("kind", ["text", "empty", "cut", "other members", "outside", "large"])
def test_a_foreign_zip_file_is_one_line(tmp_path, kind, packed, monkeypatch):
    path = tmp_path / "in" / "b.zip"
    path.parent.mkdir()
    if kind == "large":
        monkeypatch.setattr(bundle, "MOST_BYTES", 10)
    if kind == "text":
        path.write_text("text")
    elif kind in ("cut", "large"):
        path.write_bytes(packed[0].read_bytes()[: -100 if kind == "cut" else None])
    else:
        zipped(path, **{"empty": {}, "other members": {"a.txt": "a"}, "outside": {"../audit.mcap": "a"}}[kind])
    done = CliRunner().invoke(main, ["report", str(path), "--out", str(tmp_path / "in" / "r.html")])
    assert done.exit_code == 2, done.output
    assert str(path) in done.output.replace("\n", "")
    assert done.output.count("Error") == 1
    assert [one.name for one in tmp_path.rglob("*.mcap")] == []


@given(st.binary(max_size=400))
def test_any_bytes_are_refused_with_one_error(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("any") / "b.zip"
    path.write_bytes(b"PK\x03\x04" + data)
    with pytest.raises((OSError, ValueError)), unpacked(path, JUDGED_NAMES):
        pass


WORDS = st.from_regex(r"[a-z]{3,10}", fullmatch=True)


@given(
    WORDS, WORDS, st.sampled_from(["/home/{0}/run", "C:\\Users\\{0}\\run", "{0}@{1}", "held by {0} on {1}.", "{0}_1"])
)
def test_no_name_of_a_header_stays_in_a_text(user, host, text):
    header = Header("audit", "/dev/ttyACM0", "right", "0.2.0", "m", "w", "physical", 0, operator=user, host=host)
    scrubbed = scrubber([header])(text.format(user, host))
    for name in {user, host} - {"run", "held", "user", "computer", "home", "users"}:
        assert name not in scrubbed
