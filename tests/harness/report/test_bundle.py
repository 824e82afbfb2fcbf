"""A bundle holds the run without the names of user, home folder and computer, and opens elsewhere."""

import getpass
import json
import platform
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from hil.cli import main, report
from hil.cli.doctor.finding import Examined, Verdict
from hil.recordings.mcap_file import _records, read_recording, write_recording
from hil.recordings.recording import Event, Header, Series
from hil.report import bundle
from hil.report.anonymous import scrubber
from hil.report.bundle import unpacked
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
    assert about["doctor"][0]["finding"] == "***"
    assert about["left_out"] == []
    assert case["answers"] == {"cable": "*** pulled it, it is torn"}


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
        monkeypatch.setattr(bundle, "LEAST_ROOM", 10)
        monkeypatch.setattr(bundle, "MOST_TIMES", 0)
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


ACCOUNTS = (
    ("Jane Smithson", "/home/mary jane", "lab7.example.org"),
    ("jürgen", "/Users/Jürgen Groß", "MacBook-von-Jürgen.local"),
    ("O'Brien", "/home/o'brien", "obrien-laptop"),
    ("CORP\\\\hweber", "C:\\\\Users\\\\Heike Weber", "DESKTOP-4F7Q2K1"),
    ("李雷", "/home/李雷", "实验室"),
    ("jane.doe", "/export/homes/jane.doe", "node17.cluster.example"),
    ("kowalczyk99", "/mnt/users/kowalczyk99", "192.168.7.23"),
    ("mark", "/home/mark", "marksbench"),
    ("root", "/root/quillwork", "a1b2c3d4e5f6"),
    ("svc_robotics", "/opt/svc_robotics", "fe80::1ff:fe23:4567:890a"),
)
"""Operator, home and computer."""


def owned(run, account, folder):
    """Return a copy of a run whose texts name an account in every way that a person's or a computer's text can."""
    operator, home, computer = account
    shutil.copytree(run, folder / "run")
    (folder / "run" / "step-1").mkdir()
    shutil.copy(run / "audit.mcap", folder / "run" / "step-1")
    said = f"{operator} on {computer}: no hand at rfc2217://{computer}:4000, {home}/twin.toml of {operator} is old"
    for path in (folder / "run").rglob("*.mcap"):
        made = read_recording(path)
        header = replace(
            made.header, operator=operator, host=computer, command=f"aero-hil validate --unit '{home}/a.toml'",
            unit=f"{home}/a.toml", target=f"rfc2217://{computer}:4000", hand_id=f"{operator}-left",
            serial_number="55830123456", parameters={"policy": f"{home}/p.npz", "who": operator},
        )  # fmt: skip
        write_recording(replace(made, header=header, events=(Event(0.0, "info", said),)), path)
    for name in ("checks.json", "case.json"):
        path = folder / "run" / name
        content = json.loads(path.read_text())
        content |= (
            {"answers": {said: said}} if name == "case.json" else {"findings": [{"source": f"baseline {home}/b"}]}
        )
        path.write_text(json.dumps(content | {"hand_id": f"{operator}-left", "note": said}))
    return folder / "run"


@pytest.mark.parametrize("account", ACCOUNTS, ids=range(len(ACCOUNTS)))
def test_nothing_of_an_account_is_in_a_bundle(place, tmp_path, monkeypatch, account):
    run = owned(place / "run", account, tmp_path)
    told = Examined("holder", Verdict.LOOK, " ".join(account), data={"who": account[0], "55830123456": [account[1]]})
    monkeypatch.setattr(report, "examine", lambda: [told])
    done = CliRunner().invoke(
        main, ["report", str(run), "--bundle", str(tmp_path / "b.zip"), "--out", str(tmp_path / "r.html")]
    )
    with ZipFile(tmp_path / "b.zip") as archive:
        assert {"case.html", "case.json", "step-1/audit.mcap"} < set(archive.namelist()), done.output
    held = b"\n".join(everything(tmp_path / "b.zip")).decode(errors="replace").lower()
    # samples, read as text, contain any word of three letters by chance
    words = {word for text in account for word in re.findall(r"[^\W\d_]{4,}", text.lower())} | {"55830123456"}
    ordinary = {"home", "users", "root", "mark", "local", "opt", "mnt", "homes", "example", "export", "left", "node"}
    assert (words - ordinary) & {*re.findall(r"[^\W\d_]+|\d+", held)} == set()
    assert [text for text in account if text.lower() in held and text not in ("root", "mark")] == []


def test_a_name_that_is_a_channel_changes_no_subject(place, tmp_path, monkeypatch):
    be(monkeypatch, tmp_path, user="ring", host="index")
    monkeypatch.setattr(report, "examine", lambda: [])
    words = ["report", str(place / "run"), "--bundle", str(tmp_path / "b.zip"), "--out", str(tmp_path / "r.html")]
    CliRunner().invoke(main, words)
    before = json.loads((place / "run" / "checks.json").read_text())
    with ZipFile(tmp_path / "b.zip") as archive:
        after = json.loads(archive.read("checks.json"))
    for name in ("findings", "measured", "counts", "not_run"):
        keep = ("subject", "check", "measured", "expected", "passed", "words", "experiment", "excess")
        if name == "findings":
            pairs = zip(after[name], before[name], strict=True)
            assert all(one[key] == other[key] for one, other in pairs for key in keep)
        else:
            assert after[name] == before[name]


HOSTILE = """
import sys
from hil.cli import main
try:
    main(["report", *sys.argv[1:]])
finally:
    (peak,) = [line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")]
    print(int(peak) // 1024)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads /proc")
@pytest.mark.parametrize("kind", ["zeros", "samples"])
def test_a_hostile_zip_file_takes_little_memory(place, tmp_path, kind):
    path = tmp_path / "b.zip"
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        if kind == "zeros":
            with archive.open("audit.mcap", "w") as member:
                for _ in range(1000):
                    member.write(bytes(2**20))
        else:
            made = read_recording(place / "run" / "audit.mcap")
            flat = Series.of(("index",), ("A",), np.zeros(100_000), np.zeros((100_000, 1)))
            write_recording(replace(made, series={**made.series, "currents": flat}), tmp_path / "a.mcap")
            archive.write(tmp_path / "a.mcap", "audit.mcap")
    done = subprocess.run(
        [sys.executable, "-c", HOSTILE, path, "--out", tmp_path / "r.html"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2, done.stderr
    assert ("unpacks to more than" in done.stderr) == (kind == "zeros")
    assert int(done.stdout.split()[-1]) < 200
