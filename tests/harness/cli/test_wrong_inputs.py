"""Whatever is wrong with an option, a file, a place or a port: one clear line, the right code, and nothing lost.

In a command line, `WRONG` stands for the wrong thing, and the other capitals for what `make_files` writes. Of each kind
of mistake the first command line meets all of its values, each other one of them in turn.
"""

import os
import pickle
import re
import subprocess
import sys
from itertools import cycle
from pathlib import Path

import pytest
from click.testing import CliRunner
from policies import policy

from aero.exit_code import Exit
from aero.policy.file import save
from aero.whole_file import whole, write_whole
from firmware_emulator.firmware.nvs import Nvs
from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.recordings.mcap_file import write_recording
from hil.verdict.validation import validate

OPTIONS = (
    ("evaluate --on simulation --out OUT --episodes", "1.5"),
    ("run-policy --seconds", "nan"),
    ("run-policy --seconds", "604801"),
    ("record --out OUT.mcap --scale", "1.01"),
    ("validate --out OUT --seed", "-1"),
    ("validate --out OUT --only", "none"),
    ("validate --out OUT --unit", "golden"),
    ("emulate --firmware", ""),
    ("train --out OUT --minutes", "inf"),
    ("doctor --hil", ""),
)
"""One wrong value of each kind of option."""

READERS = {
    "mcap": (
        "report WRONG --out OUT.html", "view WRONG",
        "calibrate WRONG --out OUT.toml",
    ),
    "npz": ("run-policy WRONG", "calibrate --out OUT.toml WRONG", "evaluate --on simulation --out OUT WRONG"),
    "toml": (
        "validate --out OUT --unit WRONG", "emulate --unit WRONG", "run-policy --correction WRONG",
        "calibrate RECORDING --out OUT.toml --start WRONG",
    ),
    "json": ("emulate --state WRONG",),
    "pkl": ("convert-policy WRONG OUT.npz",),
    "elf": ("validate --out OUT --firmware-program WRONG", "firmware compare 0.2.0 WRONG"),
}  # fmt: skip
"""Ending of a file to the command lines that read it."""
STATES = ("text", "other", "truncated", "folder", "unreadable", "[z]", "missing", "dangling", "empty")
MAY_BE_NEW = ("emulate --state WRONG",)
"""Commands that make this file, or resume it: it may be missing, empty or cut."""
FOLDER_READERS = ("validate --out OUT --baseline WRONG", "baseline WRONG OUT", "firmware build --out OUT WRONG")

FILE_WRITERS = (
    "report RECORDING --out WRONG",
    "run-policy --record WRONG",
    "record --channel index --excite steps --out WRONG",
    "calibrate RECORDING --out WRONG",
    "convert-policy CHECKPOINT WRONG",
    "firmware build FOLDER --out WRONG",
    "emulate --state WRONG",
    "emulate --link WRONG",
    "emulate --bus-link WRONG",
    "guard /dev/ttyNoSuchHand --link WRONG",
)
FOLDER_WRITERS = (
    "validate --only presence --out WRONG",
    "evaluate --on simulation --episodes 1 --seconds 0.1 --out WRONG",
    "train --steps 1 --out WRONG",
    "baseline RESULTS WRONG",
    "guard /dev/ttyNoSuchHand --black-box WRONG",
)
PLACES = ("/sys/kernel/aero-hil", "FILE/x", "LOOP", "/dev/full", "LONG", "")
"""Where nothing can be written, whoever asks: /sys/kernel refuses the superuser too."""

PORT_USERS = (
    "validate --out OUT --hil WRONG",
    "record --out OUT.mcap --hil WRONG",
    "run-policy --hil WRONG",
    "emulate --bus-port WRONG",
    "guard WRONG",
)
PORTS = ("/dev/ttyNoSuchHand", "FILE", "FOLDER", "/dev/null", "socket://127.0.0.1:1", "none://x", "[/z]", "")


def spread(lines, values):
    """Pair the first line with every value, and each other line with the next one in turn."""
    first, *others = lines
    return [(first, value) for value in values] + list(zip(others, cycle(values)))


def wrong_files():
    for ending, lines in READERS.items():
        for line, state in spread(lines, STATES):
            if line not in MAY_BE_NEW or state not in ("missing", "dangling", "empty", "truncated"):
                yield line, f"{state}.{ending}"
    yield from spread(FOLDER_READERS, ("missing", "folder", "dangling.toml", "loop"))


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    return make_files(tmp_path_factory.mktemp("wrong"))


@pytest.fixture
def refused(names, tmp_path, monkeypatch):
    """Run a command line that is refused in one line that names something, and that changes nothing."""

    def run(line, wrong, named, codes=(2,)):
        monkeypatch.chdir(tmp_path)
        before = kept(names["IN"])
        result = CliRunner().invoke(main, [filled(word, wrong, names) for word in line.split()])
        assert result.exit_code in codes, result.output
        assert "Traceback" not in result.output
        errors = [line for line in result.output.splitlines() if line.startswith("Error: ")]
        assert errors == result.output.splitlines()[-1:]
        assert filled(named, "", names) in errors[0]
        assert kept(names["IN"]).items() >= before.items()
        assert list(tmp_path.iterdir()) == []

    return run


@pytest.mark.parametrize(("line", "value"), OPTIONS)
def test_a_wrong_value_of_an_option(refused, line, value):
    option = line.split()[-1]
    refused(f"{line} WRONG", value, {"--unit": "unit"}.get(option, option))


@pytest.mark.parametrize(("line", "name"), list(wrong_files()))
def test_a_file_that_is_something_else(refused, line, name):
    refused(line, f"IN/{name}", name)


@pytest.mark.parametrize(
    ("line", "place"), spread(FILE_WRITERS, (*PLACES, "FOLDER")) + spread(FOLDER_WRITERS, (*PLACES, "FILE"))
)
def test_a_place_where_nothing_can_be_written(refused, line, place):
    refused(line, place, place, codes=(Exit.USAGE, Exit.NOT_WRITTEN))


@pytest.mark.parametrize(("line", "port"), spread(PORT_USERS, PORTS))
def test_a_port_without_a_hand(refused, line, port):
    refused(line, port, port, codes=(2, 3))


def make_files(folder):
    """Write good files, and wrong ones by the names `STATE.ENDING`; return what the capitals stand for."""
    good = {
        "RECORDING": folder / "good.mcap",
        "POLICY": folder / "good.npz",
        "UNIT": folder / "good.toml",
        "STATE": folder / "good.json",
        "CHECKPOINT": folder / "good.pkl",
        "PROGRAM": folder / "good.elf",
    }
    with open_target() as target:
        write_recording(validate(target, ["presence"]).results["presence"].recording, good["RECORDING"])
    save(policy(), good["POLICY"])
    good["UNIT"].write_text("[servos]\nstart_temperature_c = [30.0, 30.0, 30.0, 30.0, 30.0, 30.0, 30.0]\n")
    good["STATE"].write_text('{"ext0": 2048}')
    good["CHECKPOINT"].write_bytes(pickle.dumps([{"params": [1.0] * 100}]))
    good["PROGRAM"].write_bytes(b"\x7fELF\x02\x01\x01" + bytes(200))
    for path in good.values():
        ending, content = path.suffix, path.read_bytes()
        (folder / f"folder{ending}").mkdir()
        (folder / f"empty{ending}").touch()
        (folder / f"text{ending}").write_text("Dear hand,\nhow are you?\n")
        (folder / f"truncated{ending}").write_bytes(content[: min(len(content) // 2, 60)])
        (folder / f"other{ending}").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(range(256)))
        (folder / f"unreadable{ending}").symlink_to("/proc/self/mem")
        (folder / f"dangling{ending}").symlink_to(folder / "nowhere")
        (folder / "[").mkdir(exist_ok=True)
        (folder / f"[z]{ending}").write_text("x")
    (folder / "folder").mkdir()
    (folder / "loop").symlink_to(folder / "loop")
    (folder / "file").write_text("kept")
    (folder / "results").mkdir()
    (folder / "results" / "checks.json").write_text(
        '{"hand": {"side": "right", "firmware": "0.2.0", "unit": "reference", "hand_id": ""}, "passed": true, '
        '"measured": {}}'
    )
    return {name: str(path) for name, path in good.items()} | {
        "IN": str(folder),
        "FOLDER": str(folder / "folder"),
        "LOOP": str(folder / "loop"),
        "FILE": str(folder / "file"),
        "LONG": str(folder / ("x" * 300)),
        "RESULTS": str(folder / "results"),
        "OUT": str(folder / "out"),
    }


def filled(word, wrong, names):
    """Return what a word of a command line stands for."""
    if word == "WRONG":
        return filled(wrong, "", names)
    name = re.match(r"[A-Z]*", word).group()
    return names.get(name, name) + word[len(name) :]


def kept(folder):
    """Every file of a folder, with its size and the time of its last change."""
    return {
        path: (path.lstat().st_size, path.lstat().st_mtime_ns) for path in Path(folder).iterdir() if not path.is_dir()
    }


def test_an_opengl_that_cannot_be_loaded_is_bad_usage(tmp_path):
    """MuJoCo loads it on being imported, so that it takes a process of its own."""
    command = [sys.executable, "-m", "hil.cli", "validate", "--dry-run"]
    environment = os.environ | {"MUJOCO_GL": "none", "PYTHONPATH": str(Path(__file__).parents[3])}
    ran = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 2
    assert ran.stderr.startswith("Error: MUJOCO_GL=none: ")
    assert ran.stderr.count("\n") == 1


def test_a_link_in_place_of_a_result_is_replaced_and_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("kept")
    for name in ("report.html", "state.json", f".state.json.{os.getpid()}", f".{os.getpid()}.report.html"):
        (tmp_path / name).symlink_to(victim)
    write_whole(tmp_path / "report.html", "new")
    victim.write_text("{}")
    Nvs(tmp_path / "state.json").store_extend(0, 1)
    assert victim.read_text() == "{}"
    assert (tmp_path / "report.html").read_text() == "new"
    assert not (tmp_path / "report.html").is_symlink()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.html", "state.json", "victim"]


def test_a_result_that_cannot_be_written_whole_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "checks.json"
    path.write_text("old")

    def interrupted():
        with whole(path) as draft:
            draft.write_text("half of the n")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
