"""The table of docs/commands.md from kind of ending to exit code, held against the commands."""

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from aero.errors import LinkTimeoutError
from aero.exit_code import Exit
from aero.safety import LinkLostError, SafetyStopError
from firmware_emulator.native.program import FirmwareProgramError
from hil.cli import report, validation_run
from hil.cli.exits import Ended
from hil.recordings.errors import CannotBeWrittenError
from hil.targets.hand_errors import FaultNeverFiredError
from hil.verdict.judged_run import Validation
from hil.verdict.run_end import FINISHED, EndKind, RunEnd, aborted, ended_at_closing

ROOT = Path(__file__).parents[3]
ERRORS = [
    SafetyStopError("too hot"),
    LinkLostError("lost"),
    LinkTimeoutError("no reply"),
    ConnectionError("unplugged"),
    OSError("odd"),
    FirmwareProgramError("crashed"),
    CannotBeWrittenError("full"),
    KeyboardInterrupt(),
    SystemExit(143),
    SystemExit(129),
]
ENDS = [
    *(aborted("audit", error, ()) for error in ERRORS),
    *(ended_at_closing(FINISHED, e) for e in (*ERRORS[:2], FaultNeverFiredError("never"))),
    RunEnd(EndKind.NOT_PERMITTED, error=SafetyStopError("not permitted")),
    RunEnd(EndKind.GATE),
    RunEnd(EndKind.HOST_BUSY),
    FINISHED,
]


def documented() -> dict[str, set[int]]:
    rows = re.findall(r"^\| `([A-Z_]+)` \| (.+) \|$", (ROOT / "docs" / "commands.md").read_text(), re.MULTILINE)
    return {kind: {int(code) for code in re.findall(r"(?:^|; )(\d+)", codes)} for kind, codes in rows}


def code_of(end: RunEnd, *, failed: bool, folder: Path) -> int:
    run = Validation({"audit": SimpleNamespace(findings=(SimpleNamespace(passed=not failed),))}, end, 0.0)
    with pytest.raises((Ended, SystemExit)) as ended:
        validation_run._end(run, folder)
    return ended.value.exit_code if isinstance(ended.value, Ended) else int(ended.value.code)


def codes_of_report(monkeypatch: pytest.MonkeyPatch, folder: Path) -> set[int]:
    """Exit codes of `aero-hil report` on an incomplete recording, beside good and bad results of others."""
    codes = set()
    recording = SimpleNamespace(header=SimpleNamespace(finished=False, experiment="audit"))
    monkeypatch.setattr(report, "judgeable", lambda _: recording)
    monkeypatch.setattr(report, "render_report", lambda *_: "page")
    (folder / "audit.mcap").touch()
    for passed in (True, False):
        judged = SimpleNamespace(
            results={"holding": None}, end=RunEnd(EndKind.INCOMPLETE, cut=(recording,)), whole_run=None,
            judged=[None], judged_passed=passed, passed=False, withheld=(), findings=(),
        )  # fmt: skip
        monkeypatch.setattr(report, "judge_recordings", lambda _, judged=judged: judged)
        command = [str(folder / "audit.mcap"), "--out", str(folder / "report.html")]
        codes.add(CliRunner().invoke(report.report, command).exit_code)
    return codes


def test_each_kind_of_ending_has_the_exit_codes_of_the_table(monkeypatch, tmp_path):
    found = {kind.name: set() for kind in EndKind}
    for end in ENDS:
        found[end.kind.name] |= {code_of(end, failed=failed, folder=tmp_path) for failed in (False, True)}
    found["INCOMPLETE"] = codes_of_report(monkeypatch, tmp_path)
    assert found == documented()


def test_an_error_at_closing_decides_the_code(tmp_path):
    before = aborted("audit", LinkTimeoutError("no reply"), ())
    assert code_of(replace(before, error=SafetyStopError("closed")), failed=False, folder=tmp_path) == Exit.STOPPED


@pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")
def test_an_error_on_a_terminal_breaks_between_words():
    terminal, err = os.openpty()
    try:
        line = [sys.executable, "-m", "hil.cli", "validate", "--hil", "/dev/there-is-no-such-port"]
        environment = os.environ | {"COLUMNS": "60"}
        subprocess.run(line, stdout=subprocess.DEVNULL, stderr=err, env=environment, check=False)
        said = os.read(terminal, 10_000).decode().replace("\r", "")
    finally:
        os.close(terminal)
        os.close(err)
    lines = said.splitlines()
    assert len(lines) > 1
    assert all(len(line) <= 60 for line in lines)
    assert " ".join(lines).startswith("Error: no hand at '/dev/there-is-no-such-port': ")
