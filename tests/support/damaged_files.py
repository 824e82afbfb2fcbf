"""Readers of user-supplied files, a valid file for each, and ways to damage it."""

import json
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from policies import network

from aero.actuation.coefficients import load_coefficients
from aero.policy.file import Policy, load, save
from aero.policy.interface import PolicyFileError
from aero.policy.settings import PAPER_TRAINING
from aero.policy.task import ShownAction
from firmware_emulator.firmware.nvs import Nvs
from hil.emulated.any_hand import open_target
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import read_recording, write_recording
from hil.recordings.recorder import Recorder
from hil.targets.hands_file import read_hands
from hil.verdict import baseline
from model.units import load_unit
from train.convert import CheckpointError, convert
from train.identification.trace import load_trace


def write_small_recording(path: Path) -> None:
    with open_target(seed=1) as target:
        recorder = Recorder(target, "audit")
        recorder.begin({"level": 0.1})
        for i in range(20):
            codes = np.full(7, 1000 * i)
            target.clock.sleep_until(target.clock.now() + 0.02)
            target.hand.command_codes(codes)
            recorder.add("command_codes", target.clock.now(), codes)
            recorder.add("codes", target.clock.now(), target.hand.read_codes())
        recorder.note("a note", "warning")
        write_recording(recorder.finish(), path)


def write_log(path: Path) -> None:
    t, share = np.linspace(0.0, 1.0, 30), np.linspace(0.0, 0.5, 210).reshape(30, 7)
    still = np.full((30, 7), 30.0)
    np.savez_compressed(
        path, t_cmd=t, cmd=share, t_pos=t, pos=share, cur_ma=still, temp_c=still, span_counts=np.full(7, 3278.0)
    )


def write_policy(path: Path) -> None:
    save(Policy("small", network(0, (14, 4, 14)), PAPER_TRAINING, ShownAction.LAST), path)


def write_baseline(path: Path) -> None:
    measured = {"presence": {"index": {"idle_current": 0.1, "lost_replies": None}}, "holding": {"ring": {"x": 1.5}}}
    hand = {"side": "right", "firmware": "0.2.0", "unit": "reference", "hand_id": "", "commit": ""}
    path.write_text(json.dumps({"hand": hand, "passed": True, "measured": measured, "findings": []}))


class Statistics:
    """Substitute for Brax's class, pickled under the name of that class."""

    def __init__(self) -> None:
        self.mean, self.std = np.zeros(14, np.float32), np.ones(14, np.float32)


def write_checkpoint(path: Path) -> None:
    layer = {"kernel": np.zeros((14, 14), np.float32), "bias": np.zeros(14, np.float32)}
    content = pickle.dumps((Statistics(), {"params": {"hidden_0": layer}}, {}), protocol=3)
    ours = f"c{Statistics.__module__}\nStatistics\n".encode()
    path.write_bytes(content.replace(ours, b"cbrax.training.acme.running_statistics\nRunningStatisticsState\n"))


def copied(source: str) -> Callable[[Path], None]:
    return lambda path: path.write_text((Path(__file__).parents[2] / source).read_text())


@dataclass(frozen=True)
class Reader:
    """Reader of one kind of file."""

    name: str
    """File name."""
    write: Callable[[Path], None]
    """Writes a valid file."""
    read: Callable[[Path], object]
    declared: type[Exception] = ValueError
    """Declared exceptions for a damaged file."""


def write_hands(path):
    path.write_text('[bench]\nport = "pty"\nfirmware = "0.1.5"\nside = "left"\ntwin = "a.toml"\nbaseline = "b"\n')


READERS = (
    Reader("recording.mcap", write_small_recording, read_recording, UnusableFileError),
    Reader("trace.mcap", write_small_recording, load_trace),
    Reader("log.npz", write_log, load_trace),
    Reader("policy.npz", write_policy, load, PolicyFileError),
    Reader("unit.toml", copied("model/units/reference.toml"), lambda path: load_unit(str(path))),
    Reader("checks.json", write_baseline, lambda path: baseline.load(path.parent)),
    Reader("hands.toml", write_hands, read_hands),
    Reader("state.json", lambda path: path.write_text('{"ext0": 2048, "ext6": 17}'), Nvs),
    Reader("coefficients.toml", copied("aero/actuation/coefficients/paper.toml"), load_coefficients),
    Reader("checkpoint.pkl", write_checkpoint, lambda path: convert(path, PAPER_TRAINING), CheckpointError),
)
CORPUS = Path(__file__).parents[1] / "corpus"
"""Damaged files that once raised undeclared exceptions, `READER.NAME`."""
TELLING = (b"\0" * 8, b"\xff" * 8, b"nan", b"1e999", b"-1", b"{", b"[" * 2000, b'"', b"\\u0000", b"null", b"true", b"0")


def damaged(content: bytes, seed: int) -> bytes:
    """Return bytes with one to four damages: flipped bits, truncation, a gap, repeated or inserted special bytes."""
    random = np.random.default_rng(seed)
    data = bytearray(content)
    for _ in range(random.integers(1, 5)):
        at, length = int(random.integers(0, len(data) + 1)), int(2 ** random.uniform(0.0, 8.0))
        match random.integers(0, 6):
            case 0 if at < len(data):
                data[at] ^= 1 << int(random.integers(0, 8))
            case 1 if at < len(data):
                data[at] = int(random.integers(0, 256))
            case 2:
                del data[at : at + length]
            case 3:
                data[at:at] = data[at : at + length]
            case 4:
                telling = TELLING[random.integers(0, len(TELLING))]
                data[at : at + int(random.integers(0, 2)) * len(telling)] = telling
            case 5 if random.uniform() < 0.2:
                del data[at:]
    return bytes(data)


def answered(reader: Reader, content: bytes, folder: Path) -> bool:
    """Let a reader read this content; return whether it was refused, with a declared exception that names the file."""
    path = folder / reader.name
    path.write_bytes(content)
    try:
        reader.read(path)
    except reader.declared as error:
        said = str(error)
    else:
        return False
    assert str(path.parent if reader.name == "checks.json" else path) in said
    return True
