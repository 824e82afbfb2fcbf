import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from aero.errors import LinkTimeoutError
from aero.exit_code import Exit
from hil.cli.doctor import exit_code, ports
from hil.cli.doctor.finding import Examined, Subject, Verdict
from hil.cli.doctor.machine import TICK_S, TICKS, check_jitter, lateness_s, needs
from hil.cli.doctor.ports import (
    HAND_USB,
    SPANS,
    UDEV_COPY,
    Answers,
    Port,
    ask,
    candidates,
    check_calibration,
    check_hand,
    check_ports,
    holders,
)
from hil.cli.exits import ending
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.pty_process import serve_in_child

HOMED = tuple(span // 3 * 65535 // span for span in SPANS.tolist())
RESTARTED = (*HOMED[:4], 400 * 65535 // 1025, 500 * 65535 // 1296, HOMED[6])


@pytest.mark.parametrize(
    "version", ["pre", "main", *(pytest.param(version, marks=pytest.mark.slow) for version in ("0.1.0", "0.2.0"))]
)
def test_the_fingerprint_of_an_emulated_board_names_its_version_and_moves_nothing(version: str) -> None:
    with serve_in_child(EmulatedSpec(firmware=version)) as (path, _):
        first = ask(path)
        second = ask(path)
    assert version in candidates(first)
    assert ("pre" in candidates(first)) == (version == "pre")
    assert (candidates(first) == ("main",)) == (version == "main")
    assert np.abs(np.subtract(first.codes, second.codes)).max() < 200  # three counts of the narrowest window


def test_a_boot_text_narrows_the_versions_down() -> None:
    answers = Answers(HOMED, knows_limits=True, knows_calibrate_mid=False, boot_text="[BOOT] Auto Homing")
    assert candidates(answers) == ("0.1.3",)


def test_a_restart_without_homing_shows_in_the_thumb() -> None:
    assert candidates(Answers(RESTARTED, knows_limits=True, knows_calibrate_mid=False, boot_text="")) == ("0.2.0",)
    found = check_calibration(RESTARTED)
    assert found.verdict is Verdict.LOOK
    assert "home" in found.remedy
    assert check_calibration(HOMED).verdict is Verdict.OK


def test_a_port_that_does_not_answer_is_a_finding() -> None:
    master, slave = pty.openpty()
    try:
        (found,) = check_hand(os.ttyname(slave))
    finally:
        os.close(master)
        os.close(slave)
    assert (found.check, found.verdict, found.subject) == ("answer", Verdict.WRONG, Subject.LINK)


def test_a_line_that_gives_back_what_is_sent_is_no_hand() -> None:
    (found,) = check_hand("loop://")
    assert (found.check, found.verdict, found.subject) == ("answer", Verdict.WRONG, Subject.LINK)
    assert "only echoes what is sent" in found.finding


def test_a_port_that_another_program_holds_is_left_alone() -> None:
    findings = list(check_hand("/dev/there-is-no-such-port", ["screen (12)"]))
    assert "screen (12)" in findings[0].finding
    assert exit_code(findings) is Exit.NO_HAND


def test_rights_and_holder_say_what_to_do() -> None:
    port = Port("/dev/ttyACM0", HAND_USB, permitted=False, group="dialout", holders=("screen (12)",))
    found = {finding.check: finding for finding in check_ports([port])}
    assert found["rights"].verdict is Verdict.WRONG
    assert found["rights"].copy == UDEV_COPY
    assert "screen (12)" in found["holder"].finding


def test_a_package_that_is_missing_is_no_defect_but_a_missing_module_of_ours_is() -> None:
    code, said = ending(ModuleNotFoundError("No module named 'rich'", name="rich"))
    assert code == Exit.USAGE
    assert "rich is not installed" in said
    assert ending(ModuleNotFoundError("No module named 'hil.x'", name="hil.x"))[0] == Exit.DEFECT


def test_who_holds_a_port_is_named_but_not_who_serves_it() -> None:
    master, slave = pty.openpty()
    reading = [sys.executable, "-c", "import sys; sys.stdin.read()"]
    serving = subprocess.Popen(reading, stdin=subprocess.PIPE, pass_fds=(master, slave))
    with serving, subprocess.Popen(reading, stdin=slave) as held:
        found = holders(os.ttyname(slave))
        held.kill()
        serving.kill()
    os.close(master)
    os.close(slave)
    assert found == (f"{Path(sys.executable).name} ({held.pid})",)


@pytest.mark.parametrize(("late_s", "verdict"), [(0.001, "ok"), (0.05, "look"), (10.0, "wrong")])
def test_jitter_is_judged_by_what_the_guard_needs(late_s: float, verdict: str) -> None:
    assert check_jitter(np.array([0.0, late_s])).verdict == verdict


def test_an_extra_without_its_packages_is_not_usable() -> None:
    declared = {"aero-hil": ["numpy>=2", "mujoco>=3 ; extra == 'emulate'", "aero-hil[emulate] ; extra == 'hil'"]}
    found = needs("hil", lambda name: declared.get(name, []), lambda name: None)
    assert found == {"mujoco": None}


@pytest.mark.parametrize(
    ("subject", "verdict", "code"),
    [
        (Subject.MACHINE, Verdict.OK, 0),
        (Subject.MACHINE, Verdict.LOOK, 0),
        (Subject.HAND, Verdict.WRONG, 1),
        (Subject.LINK, Verdict.WRONG, 3),
    ],
)
def test_exit_codes(subject: Subject, verdict: Verdict, code: int) -> None:
    assert exit_code([Examined("x", verdict, "found", subject=subject)]) == code


def test_the_command_prints_json_and_says_that_no_hand_answers() -> None:
    command = [sys.executable, "-m", "hil.cli", "doctor", "--json", "--hil", "/dev/there-is-no-such-port"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    printed = json.loads(ran.stdout)
    assert ran.returncode == Exit.NO_HAND, ran.stderr
    assert (printed["format"], printed["verdict"]) == (1, "wrong")
    assert {"python", "extras", "drawing", "jitter", "ports", "answer"} <= {row["check"] for row in printed["findings"]}


def test_a_busy_computer_is_named_before_the_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    def silent(port: str) -> ports.Answers:
        raise LinkTimeoutError("no reply")

    monkeypatch.setattr(ports, "ask", silent)
    for load, said in ((1.0, "no reply"), (11.0, "this computer is busy (load 11 on 2 cores)")):
        monkeypatch.setattr(ports, "_load", lambda load=load: (load, 2))
        assert next(ports.check_hand("port")).finding.startswith(said)


def test_a_port_that_was_not_asked_blames_no_busy_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ports, "_load", lambda: (11.0, 2))
    (found,) = check_hand("/dev/there-is-no-such-port")
    assert found.finding.startswith("cannot open /dev/there-is-no-such-port")


def test_a_pseudo_terminal_of_another_account_needs_no_rule() -> None:
    port = Port("/tmp/hand", permitted=False, group="tty", server="ada")
    rights = next(one for one in check_ports([port], "/tmp/hand") if one.check == "rights")
    assert "pseudo-terminal of the account `ada`" in rights.finding
    assert not rights.copy
    assert "usermod" not in rights.remedy


def test_the_lateness_is_what_each_wait_is_late():
    """Every wait is made, and a late one is measured alone."""

    class Late:
        time, waits = 0.0, 0

        def now(self):
            return self.time

        def sleep_until(self, t):
            self.waits += 1
            self.time = t + 0.002 * (self.waits == 3)

    late = lateness_s(clock := Late())
    assert clock.waits == TICKS == len(late)
    assert clock.time == pytest.approx(TICKS * TICK_S + 0.002)
    assert np.flatnonzero(late > 0.001).tolist() == [2]
