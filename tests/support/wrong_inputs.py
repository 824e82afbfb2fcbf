"""Wrong inputs to the command line, as tables.

In a command line, `WRONG` stands for the wrong thing, and the other capitals for what `make_files` writes.
"""

import pickle
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from policies import policy

from aero.policy.file import save
from hil import open_target
from hil.recordings.mcap_file import write_recording
from hil.recordings.recorder import Recorder

WHOLE = ("nan", "inf", "1.5", "", "abc", "1e999")
NUMBER = ("nan", "inf", "-inf", "-1", "", "abc", "1e999")
TOO_LARGE = "99999999999999999999"
COUNT = (*WHOLE, "0", "-1", TOO_LARGE)
SEED = (*WHOLE, "-1", TOO_LARGE)
NAME = ("none", "")
UNIT = ("golden", "", "golden.toml")

OPTIONS = {
    "evaluate --on mujoco --out OUT": {
        "--episodes": COUNT,
        "--trials": COUNT,
        "--units": (*WHOLE, "-1", TOO_LARGE),
        "--seconds": (*NUMBER, "0"),
        "--seed": SEED,
        "--on": NAME,
    },
    "run-policy": {
        "--seconds": (*NUMBER, "0", "1e308", "604801"),
        "--wait": NUMBER,
        "--rehearse": NUMBER,
        "--max-current": (*NUMBER, "0", "50"),
        "--settings": NAME,
        "--twin": UNIT,
        "--seed": SEED,
    },
    "record --out OUT.mcap": {
        "--scale": (*NUMBER, "0", "1.01"),
        "--excite": NAME,
        "--channel": ("thumb", ""),
        "--unit": UNIT,
        "--seed": SEED,
    },
    "validate --out OUT": {"--only": NAME, "--firmware": NAME, "--hand": NAME, "--unit": UNIT, "--seed": SEED},
    "endurance --log OUT.jsonl": {"--cycles": (*COUNT, "1")},
    "map --to codes POSTURE": {"--from": NAME},
    "map --from compact POSTURE": {"--to": NAME},
    "map --from compact --to codes POSTURE": {
        "--firmware": NAME, "--calibration": NAME, "--coefficients": NAME, "--hand": NAME,
    },
    "identify --out OUT": {"--hand": NAME, "--figure": NAME},
    "calibrate RECORDING --out OUT.toml": {"--start": UNIT, "--jobs": COUNT, "--firmware": NAME},
    "train --out OUT": {"--minutes": (*NUMBER, "0"), "--steps": COUNT, "--seed": SEED, "--backend": NAME},
    "emulate": {"--seed": SEED, "--unit": UNIT, "--firmware": NAME, "--hand": NAME, "--parent": WHOLE},
    "firmware compare 0.2.0 0.2.0": {"--seeds": COUNT, "--seed": SEED, "--only": NAME},
    "campaign --out OUT": {
        "--healthy": (*WHOLE, "-1", TOO_LARGE), "--hands": COUNT, "--workers": COUNT, "--first-seed": SEED,
    },
    "doctor": {"--hil": ("",)},
    "convert-policy CHECKPOINT OUT.npz": {"--settings": NAME, "--shown-action": NAME},
}  # fmt: skip
"""Command line, option, wrong values."""

READERS = {
    "report WRONG --out OUT.html": "mcap",
    "diff RECORDING WRONG": "mcap",
    "diff WRONG RECORDING": "mcap",
    "replay WRONG": "mcap",
    "view WRONG": "mcap",
    "calibrate WRONG --out OUT.toml": "mcap",
    "calibrate --out OUT.toml WRONG": "npz",
    "run-policy WRONG": "npz",
    "evaluate --on mujoco --out OUT WRONG": "npz",
    "validate --out OUT --unit WRONG": "toml",
    "emulate --unit WRONG": "toml",
    "run-policy --twin WRONG": "toml",
    "calibrate RECORDING --out OUT.toml --start WRONG": "toml",
    "map --from compact --to codes POSTURE --coefficients WRONG": "toml",
    "map --from compact --to codes WRONG": "json",
    "emulate --state WRONG": "json",
    "endurance --cycles 2 --log WRONG": "jsonl",
    "convert-policy WRONG OUT.npz": "pkl",
    "validate --out OUT --firmware-program WRONG": "elf",
    "firmware compare 0.2.0 WRONG": "elf",
}
"""Command line and the ending of the file that it reads."""
FOLDER_READERS = ("validate --out OUT --baseline WRONG", "baseline WRONG OUT", "firmware build --out OUT WRONG")
STATES = ("missing", "folder", "empty", "text", "truncated", "other", "unreadable", "dangling", "[z]")
MAY_BE_NEW = {
    "emulate --state WRONG": {"missing", "dangling"},
    "endurance --cycles 2 --log WRONG": {"missing", "empty"},
}
"""Files that these commands make, or go on with."""

FILE_WRITERS = (
    "record --channel index --excite steps --out WRONG",
    "run-policy --record WRONG",
    "report RECORDING --out WRONG",
    "replay RECORDING --out WRONG",
    "calibrate RECORDING --out WRONG",
    "endurance --cycles 2 --log WRONG",
    "convert-policy CHECKPOINT WRONG",
    "firmware build FOLDER --out WRONG",
    "emulate --state WRONG",
    "emulate --link WRONG",
    "emulate --bus-link WRONG",
)
FOLDER_WRITERS = (
    "validate --only presence --out WRONG",
    "evaluate --on mujoco --episodes 1 --seconds 0.1 --out WRONG",
    "identify --out WRONG",
    "train --steps 1 --out WRONG",
    "calibrate RECORDING --out OUT.toml --plots WRONG",
    "baseline RESULTS WRONG",
)
PLACES = ("/sys/kernel/aero-hil", "FILE/x", "LOOP", "/dev/full", "LONG", "")
"""Where nothing can be written, whoever asks: /sys/kernel refuses the superuser too."""

PORT_USERS = (
    "validate --out OUT --hil WRONG",
    "record --out OUT.mcap --hil WRONG",
    "run-policy --hil WRONG",
    "endurance --cycles 2 --log OUT.jsonl --hil WRONG",
    "replay RECORDING --hil WRONG",
    "servos --port WRONG scan",
    "emulate --bus-port WRONG",
)
PORTS = ("/dev/ttyNoSuchHand", "FILE", "FOLDER", "/dev/null", "socket://127.0.0.1:1", "none://x", "[/z]", "")


class Case(NamedTuple):
    """A wrong command line."""

    kind: str
    line: str
    wrong: str
    named: str
    """What the answer has to name, after `filled`."""


def cases() -> Iterator[Case]:
    """Yield every case of the tables."""
    for line, options in OPTIONS.items():
        for option, values in options.items():
            named = {"--unit": "unit", "--twin": "unit", "--start": "unit", "--coefficients": "coefficients"}
            yield from (Case("option", f"{line} {option} WRONG", value, named.get(option, option)) for value in values)
    for line, ending in READERS.items():
        for state in STATES:
            if state not in MAY_BE_NEW.get(line, ()):
                name = f"{state}.{ending}"
                yield Case("file", line, f"IN/{name}", name)
    for line in FOLDER_READERS:
        yield from (Case("file", line, f"IN/{name}", name) for name in ("missing", "folder", "dangling.toml", "loop"))
    for line in FILE_WRITERS:
        yield from (Case("output", line, place, place) for place in (*PLACES, "FOLDER"))
    for line in FOLDER_WRITERS:
        yield from (Case("output", line, place, place) for place in (*PLACES, "FILE"))
    for line in PORT_USERS:
        yield from (Case("device", line, port, port) for port in PORTS)


def make_files(folder: Path) -> dict[str, str]:
    """Write good files, and wrong ones by the names `STATE.ENDING`; return what the capitals stand for."""
    good = {
        "RECORDING": folder / "good.mcap",
        "POLICY": folder / "good.npz",
        "UNIT": folder / "good.toml",
        "POSTURE": folder / "good.json",
        "LOG": folder / "good.jsonl",
        "CHECKPOINT": folder / "good.pkl",
        "PROGRAM": folder / "good.elf",
    }
    with open_target() as target:
        recorder = Recorder(target, "audit")
        recorder.begin()
        target.hand.read_codes()
        write_recording(recorder.finish(), good["RECORDING"])
    save(policy(), good["POLICY"])
    good["UNIT"].write_text("[servos]\nstart_temperature_c = [30.0, 30.0, 30.0, 30.0, 30.0, 30.0, 30.0]\n")
    good["POSTURE"].write_text("[30, 30, 30, 30, 45, 20, 10]")
    good["LOG"].write_text('{"closed_percent": [1, 1, 1, 1, 1, 1, 1], "open_percent": [1, 1, 1, 1, 1, 1, 1]}')
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
    (folder / "results" / "checks.json").write_text('{"measured": {}}')
    return {name: str(path) for name, path in good.items()} | {
        "IN": str(folder),
        "FOLDER": str(folder / "folder"),
        "LOOP": str(folder / "loop"),
        "FILE": str(folder / "file"),
        "LONG": str(folder / ("x" * 300)),
        "RESULTS": str(folder / "results"),
        "OUT": str(folder / "out"),
    }


def filled(word: str, wrong: str, names: Mapping[str, str]) -> str:
    """Return what a word of a command line stands for."""
    if word == "WRONG":
        return filled(wrong, "", names)
    name = re.match(r"[A-Z]*", word).group()
    return names.get(name, name) + word[len(name) :]
