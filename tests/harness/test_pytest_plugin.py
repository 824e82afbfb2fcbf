"""The plugin as an installed project registers it: options, header, fixtures, and what it says when it is wrong."""

import pytest

pytest_plugins = ["pytester"]

ONE_TEST = "def test_reads(hand, target):\n    assert hand.read_codes().shape == (7,)\n    assert target.name == {!r}"


@pytest.fixture
def run(pytester):
    def run_with(*arguments, target="emulated"):
        pytester.makepyfile(ONE_TEST.format(target))
        return pytester.runpytest_subprocess(*arguments)

    return run_with


def test_the_default_is_the_emulated_hand(run):
    result = run()
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["aero-hil: right hand on emulated, firmware 0.2.0, unit reference, seed 0"])


def test_options_reach_the_hand(run, pytester):
    result = run("--hil=pty", "--hil-hand=left", "--hil-firmware=0.1.5", "--hil-seed=4", target="pty")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["aero-hil: left hand on pty, firmware 0.1.5, unit reference, seed 4"])


def test_a_missing_hand_is_one_error_that_names_the_port(run):
    result = run("--hil=/dev/ttyNoSuchHand")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    errors = [line for line in result.errlines + result.outlines if line.startswith("ERROR")]
    assert len(errors) == 1
    assert "/dev/ttyNoSuchHand" in errors[0]
    assert "ttyACM0" in errors[0]


@pytest.mark.parametrize(
    ("option", "message"),
    [("--hil-firmware=9.9", "unknown firmware '9.9'"), ("--hil-unit=golden", "no unit 'golden'")],
)
def test_an_impossible_hand_is_a_usage_error(run, option, message):
    result = run(option)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert message in result.stderr.str()


def test_a_physical_hand_is_not_shared_between_processes(run):
    result = run("--hil=/dev/ttyACM0", "-n", "2")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert "run without -n" in result.stderr.str()


def test_a_suite_without_a_hand_never_opens_one(pytester):
    pytester.makepyfile("def test_nothing():\n    pass")
    result = pytester.runpytest_subprocess("--hil=/dev/ttyNoSuchHand")
    result.assert_outcomes(passed=1)
