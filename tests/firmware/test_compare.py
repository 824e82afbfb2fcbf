"""The comparison finds what differs between emulated versions, and nothing within one."""

import pytest
from click.testing import CliRunner

from firmware_emulator.compare.run import compare, contender
from firmware_emulator.compare.sessions import MAKERS, Send, sessions
from hil.cli import main


def outcomes(name, first, second, seed=3):
    return [compare(session, contender(first, "right"), contender(second, "right")) for session in sessions(name, seed)]


@pytest.mark.parametrize("name", ["opcodes", "torque", "damage"])
def test_a_firmware_is_the_same_as_itself(name):
    (outcome,) = outcomes(name, "0.2.0", "0.2.0")
    assert outcome.difference is None
    assert outcome.packets > 100


def test_the_first_difference_is_shown_as_bytes_with_times():
    (outcome,) = outcomes("torque", "0.1.0", "0.1.1")
    assert outcome.difference is not None
    said = outcome.difference.lines(("0.1.0", "0.1.1"))
    assert said[0].startswith("first difference on the servo bus at ")
    assert any(line.startswith("  0.1.1") and " ms  ff ff " in line for line in said)
    assert any("degrees apart" in line for line in said)


def test_same_seed_same_sessions_other_seed_others():
    for name in MAKERS:
        assert sessions(name, 1) == sessions(name, 1)
    assert sessions("fuzz", 1) != sessions("fuzz", 2)


def test_the_command_says_what_differs_and_exits_so():
    run = CliRunner().invoke(main, ["firmware", "compare", "0.1.4", "0.1.5", "--only", "split", "--seed", "2"])
    assert run.exit_code == 1, run.output
    assert "seed 2, split frames:\nfirst difference on the " in run.output
    same = CliRunner().invoke(main, ["firmware", "compare", "0.1.5", "0.1.5", "--only", "split"])
    assert same.exit_code == 0, same.output
    assert same.output.startswith("no difference: ")


def test_what_the_command_writes_is_what_it_compares_with(tmp_path):
    file = str(tmp_path / "sessions.jsonl.xz")
    write = ["firmware", "compare", "main", "main", "--only", "calibrate_mid", "--only", "torque", "--write", file]
    assert CliRunner().invoke(main, write).exit_code == 0
    same = CliRunner().invoke(main, ["firmware", "compare", "main", file])
    assert same.output.startswith("no difference: "), same.output
    other = CliRunner().invoke(main, ["firmware", "compare", "0.2.0", file, "--only", "calibrate_mid"])
    assert other.exit_code == 1, other.output
    assert "CALIBRATE_MID on every channel:\nfirst difference on the " in other.output


def test_a_file_that_would_not_be_read_again_is_not_written(tmp_path):
    refused = CliRunner().invoke(main, ["firmware", "compare", "main", "main", "--write", str(tmp_path / "some.json")])
    assert refused.exit_code == 2
    assert "name the file *.jsonl.xz" in " ".join(refused.output.split())


def test_a_new_id_is_followed_by_every_reading():
    """A comparison is blind to what no reading shows at the end."""
    for session in sessions("set_id", 1):
        sent = b"".join(step.data for step in session.steps if isinstance(step, Send))[::16]
        assert {0x22, 0x24, 0x25} <= set(sent[sent.rindex(0x02) :]), session.name
