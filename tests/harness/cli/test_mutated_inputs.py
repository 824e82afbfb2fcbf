"""Wrong inputs through every command: one line that says what is wrong, quick and small, and never exit code 70.

Recordings, their headers and columns, units and options are mutated by seed; other files in `test_damaged_files.py`.
`MUTATED_INPUTS=2000 pytest -s -m slow tests/harness/cli/test_mutated_inputs.py` does it for 2,000 inputs.
"""

import dataclasses
import functools
import os
import re
import shutil
import time
import warnings

import numpy as np
import pytest
from click.testing import CliRunner
from damaged_files import damaged

from hil.cli import main
from hil.emulated.any_hand import open_target
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import read_recording, write_recording
from hil.recordings.recording import Series
from hil.report.results import write_results
from hil.verdict.validation import validate
from hil.view import web_page

try:
    import resource
except ImportError:  # Windows
    resource = None

EACH = int(os.environ.get("MUTATED_INPUTS", "2000")) // 3
QUICK = 25
LONGEST_LOOPS, MOST_MB = 40, 500.0
"""The most that a command may take: processor time in runs of the loop of `loop_s`, 40 of about 0.5 s, and memory."""
NAMES = ("presence", "audit")
UNKNOWN = {
    "experiment": ("wink", "staircase", "session", "audit", "calibration", "policy"),
    "firmware": ("9.9", "0.3.0", "pre", "main", "0.1.5"), "side": ("left", "both"), "window": ("other", "homed"),
    "map": ("other",), "unit": ("physical", "plausible:3", "golden", "x.toml"), "limits": ("other", "plausible"),
}  # fmt: skip
"""What a header of a newer version, or of another hand, may say."""
ODD_NUMBERS = ("0", "0.0", "-1.0", "1e-300", "1e300", "1e9", "nan", "inf", "true", '"x"', "[]", "99999999999999999999")
"""What a number of a unit may have become."""
REPLACEMENTS = (
    "", "x", "[/z]", "\0", "9" * 400, -1, 0, 1, 2**70, 1e308, -0.0, True, None, [], {}, ["a"], {"a": 1}, {"a": "b"},
)  # fmt: skip
"""What a value of a header may have become."""
RECORDING_LINES = (
    "report FILE --out OUT.html",
    "export FILE --out OUT.mcap",
    "view FILE",
)


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Results of a validation with its recordings, and a unit."""
    folder = tmp_path_factory.mktemp("good")
    with open_target(seed=3) as target:
        (folder / "results").mkdir()
        write_results(validate(target, NAMES, folder=folder / "results"), folder / "results")
    shutil.copy("model/units/reference.toml", folder / "unit.toml")
    return folder


@pytest.fixture(autouse=True)
def _pages_are_left_at_once(monkeypatch):
    def leave(_page):
        raise KeyboardInterrupt

    monkeypatch.setattr(web_page.Page, "tick", leave)


@functools.cache
def loop_s():
    """Return the processor time of the loop that README measures cores by, s."""
    begin = time.process_time()
    exec("x = 0\nfor i in range(10_000_000): x += i", {})
    return time.process_time() - begin


def run(line):
    """Run a command; return its exit code and what it said, after what has to hold for every command."""
    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = CliRunner().invoke(main, line)
    took = time.process_time() - begin
    assert "Traceback" not in result.output, result.output[-2000:]
    assert result.exit_code != 70, (line, result.output[-2000:])
    assert took < LONGEST_LOOPS * loop_s(), f"{' '.join(line)} took {took:.1f} s"
    return result.exit_code, result.output


def altered(recording, random):
    """Return a recording whose header, series or bytes are not what its experiment leaves."""
    header, series = recording.header, dict(recording.series)
    match random.integers(0, 7):
        case 4:
            name = list(series)[random.integers(len(series))]
            one = series[name]
            keep = np.delete(np.arange(len(one.columns)), random.integers(len(one.columns)))
            series[name] = Series.of(
                [one.columns[k] for k in keep], [one.units[k] for k in keep], one.times, one.values[:, keep]
            )
        case 5:
            field = list(UNKNOWN)[random.integers(len(UNKNOWN))]
            header = dataclasses.replace(header, **{field: UNKNOWN[field][random.integers(len(UNKNOWN[field]))]})
        case 6:
            name = list(series)[random.integers(len(series))]
            one = series[name]
            odd = (0.0, 1e300, -1e300, 2.0**63)[random.integers(4)]
            series[name] = dataclasses.replace(one, values=np.full_like(one.values, odd))
        case 0:
            name = list(header.parameters)[random.integers(len(header.parameters))] if header.parameters else "x"
            value = REPLACEMENTS[random.integers(len(REPLACEMENTS))]
            header = dataclasses.replace(header, parameters={**header.parameters, name: value})
        case 1:
            del series[list(series)[random.integers(len(series))]]
        case 2:
            name = list(series)[random.integers(len(series))]
            one = series[name]
            keep = int(random.integers(0, 3))
            series[name] = dataclasses.replace(one, times=one.times[:keep].copy(), values=one.values[:keep].copy())
        case 3:
            field = dataclasses.fields(header)[random.integers(len(dataclasses.fields(header)))].name
            value = REPLACEMENTS[random.integers(len(REPLACEMENTS))]
            header = dataclasses.replace(header, **{field: value})
    return dataclasses.replace(recording, header=header, series=series)


def same(path, recording):
    """Return whether a file still holds this recording, in what a verdict is made of."""
    try:
        return read_recording(path) == recording
    except UnusableFileError:
        return False


def recordings(good, folder, count):
    seen = {"refused": 0, "same": 0, "other": 0}
    paths = [good / "results" / f"{name}.mcap" for name in (*NAMES, "session")]
    whole = {path: read_recording(path) for path in paths}
    for seed in range(count):
        random = np.random.default_rng(seed)
        path = paths[random.integers(len(paths))]
        spoiled = folder / "spoiled.mcap"
        changed = seed % 2
        if changed:
            try:
                write_recording(altered(whole[path], random), spoiled)
            except (TypeError, ValueError, AttributeError, OverflowError):
                continue  # no program of ours writes this
        else:
            spoiled.write_bytes(damaged(path.read_bytes(), seed))
        text = RECORDING_LINES[random.integers(len(RECORDING_LINES))]
        names = {"FILE": spoiled, "GOOD": path, "OUT.html": folder / "o.html", "OUT.mcap": folder / "o.mcap"}
        code, said = run([str(names.get(word, word)) for word in text.split()])
        if code in {0, 1} and text.startswith("report") and not changed:
            assert same(spoiled, whole[path]), f"a verdict from a damaged file, seed {seed}: {said}"
        seen["refused" if code == 2 else "same" if code == 0 else "other"] += 1
    return seen


def odd_number(content, random):
    """Return a TOML file in which one number, or one of a list, is another."""
    numbers = list(re.finditer(rb"(?<=[=\[ ])-?[0-9][0-9.e+-]*(?=[,\]\n])", content))
    one = numbers[random.integers(len(numbers))]
    return content[: one.start()] + ODD_NUMBERS[random.integers(len(ODD_NUMBERS))].encode() + content[one.end() :]


def units(good, folder, count):
    seen = {"refused": 0, "used": 0}
    content = (good / "unit.toml").read_bytes()
    for seed in range(count):
        random = np.random.default_rng(seed)
        (folder / "u.toml").write_bytes(odd_number(content, random) if seed % 2 else damaged(content, seed))
        text = (
            "validate --dry-run --unit FILE",
            "run-policy --dry-run --seconds 0.1 --wait 0 --empty --correction FILE",
        )
        code, said = run(text[seed % 10 == 0].replace("FILE", str(folder / "u.toml")).split())
        assert code in {0, 2, 3, 4}, said
        seen["refused" if code == 2 else "used"] += 1
    return seen


LINES = (
    "validate --only presence --dry-run --hil emulated --firmware 0.2.0 --side right --unit reference --seed 3",
    "validate --only presence --dry-run --fault motor_weak:ring=0.4@0.5 --zeros ideal --baseline b",
    "record --dry-run --excite fingers --channel ring --scale 0.3 --out x.mcap",
    "run-policy steady --dry-run --seconds 0.1 --wait 0 --empty --correction reference",
    "report x.mcap --out r.html",
    "export x.mcap --out y.mcap",
    "firmware compare 0.2.0 0.1.5 --only homing --seed 0",
    "doctor --hil emulated --json",
    "faults",
    "baseline r --out b",
    "emulate --listen 127.0.0.1:x --fault link_silent",
    "proxy /dev/none --link p --fault reply_lost=0.5",
    "guard /dev/none --link p --firmware 0.1.5 --side left --black-box b",
    "calibrate x.mcap --start reference --out u.toml",
    "evaluate steady --units 1 --seconds 0.1 --seed 1",
    "campaign --healthy 1 --only presence --first-seed 3 --workers 1 --out c",
)
WORDS = (
    "", "-1", "0", "1e999", "nan", "x", "/", "caf\udce9", "../..", "[/z]", "--", "-h", "plausible:-1", "ring",
    "plausible:99999999999999999999", "motor_dead", "motor_weak:ring=nan", "link_silent@-1", "socket://",
    "\u202e", "9" * 400, "rfc2217://[", "u.toml", "h.toml", "loop://",
)  # fmt: skip
"""What a word of a command may have become."""


def options(good, folder, count):
    seen = {}
    shutil.copy(good / "results" / "presence.mcap", folder / "x.mcap")
    shutil.copy(good / "unit.toml", folder / "u.toml")
    for seed in range(count):
        random = np.random.default_rng(seed)
        words = LINES[random.integers(len(LINES))].split()
        if random.integers(2):
            words[random.integers(len(words))] = WORDS[random.integers(len(WORDS))]
        else:
            words.insert(random.integers(1, len(words) + 1), WORDS[random.integers(len(WORDS))])
        with pytest.MonkeyPatch.context() as patched:
            patched.chdir(folder)
            # A mistake that is none would serve a port until somebody ends it.
            patched.setattr("firmware_emulator.links.pty.PtyServer.run", lambda _self, stop: None)
            code, _said = run(words)
        seen[code] = seen.get(code, 0) + 1
    return seen


KINDS = [recordings, units, options]


def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 if resource else 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_are_answered_by_every_command(kind, good, tmp_path):
    kind(good, tmp_path, QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_of_damaged_files_are_answered_by_every_command(kind, good, tmp_path):
    kind(good, tmp_path, 3)
    before = peak_mb()
    print(f"\n{kind.__name__}: {EACH}, {kind(good, tmp_path, EACH)}, peak {peak_mb() - before:+.0f} MB")
    assert peak_mb() - before < MOST_MB
