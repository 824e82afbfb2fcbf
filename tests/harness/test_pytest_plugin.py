"""The plugin as an installed project registers it: options, header, fixtures, and what it says when it is wrong."""

import pytest

import hil.targets.target  # noqa: F401 - loaded before pytester's snapshot, because NumPy can be loaded only once

pytest_plugins = ["pytester"]

ONE_TEST = """
def test_reads(aero_hand, aero_target):
    assert aero_hand.read_codes().shape == (7,)
    assert aero_target.name == {!r}
"""


@pytest.fixture
def run(pytester):
    def run_with(*arguments, target="emulated"):
        pytester.makepyfile(ONE_TEST.format(target))
        return pytester.runpytest(*arguments)

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
    result = pytester.runpytest("--hil=/dev/ttyNoSuchHand")
    result.assert_outcomes(passed=1)


def test_a_session_without_a_hand_shows_no_hand(pytester):
    pytester.makepyfile("def test_nothing():\n    pass")
    assert "right hand on" not in pytester.runpytest().stdout.str()


def test_a_failure_shows_the_target_in_one_line(pytester):
    pytester.makepyfile("def test_fails(aero_target):\n    assert aero_target is None")
    shown = pytester.runpytest().stdout.str()
    assert "<Target: right hand on emulated, firmware 0.2.0, unit reference, seed 0>" in shown
    assert "WireLog object" not in shown


SUITE = """
import pytest

def test_ordinary(aero_target):
    pass

@pytest.mark.moves
def test_moves(aero_target):
    pass

@pytest.mark.homes
def test_homes(aero_target):
    pass

@pytest.mark.takes_long
def test_takes_long(aero_target):
    pass

@pytest.mark.needs_ground_truth
def test_needs(aero_target):
    pass

@pytest.mark.presence
def test_presence(aero_target):
    assert {there}
"""


def test_each_skip_says_which_option_changes_it(pytester):
    pytester.makepyfile(SUITE.format(there=True))
    result = pytester.runpytest("--hil=pty", "--hil-still", "-rs", "--strict-markers")
    result.assert_outcomes(passed=2, skipped=4)
    for words in ("--hil-still", "--hil-homing", "--hil-long", "--hil=emulated"):
        assert words in result.stdout.str()


def test_options_bring_back_what_was_skipped(pytester):
    pytester.makepyfile(SUITE.format(there=True))
    pytester.runpytest("--hil=pty", "--hil-homing", "--hil-long").assert_outcomes(passed=5, skipped=1)


def test_nothing_is_skipped_on_the_emulated_hand(pytester):
    pytester.makepyfile(SUITE.format(there=True))
    pytester.runpytest().assert_outcomes(passed=6)


def test_a_hand_that_fails_the_presence_test_is_not_tested_further(pytester):
    pytester.makepyfile(SUITE.format(there=False))
    result = pytester.runpytest("-rs")
    result.assert_outcomes(failed=1, skipped=5)
    result.stdout.fnmatch_lines(["*this hand failed test_presence; mend that first*"])


def test_the_junit_report_says_which_hand_it_was(pytester):
    pytester.makepyfile(SUITE.format(there=True))
    pytester.runpytest("--hil-seed=6", "--junitxml=report.xml")
    report = (pytester.path / "report.xml").read_text()
    for name, value in (("target", "emulated"), ("firmware", "0.2.0"), ("map", "paper"), ("seed", "6")):
        assert f'<property name="hil_{name}" value="{value}"' in report
    assert "hil_commit" in report


WITH_FAULTS = """
import pytest

@pytest.mark.fault("motor_dead:ring", "encoder_offset:index=100")
def test_a_faulty_hand(aero_target, aero_hand):
    aero_hand.command_codes([30000] * 7)
    aero_target.clock.sleep_until(aero_target.clock.now() + 1.0)
    codes = aero_hand.read_codes()
    assert codes[2] < 5000 < 25000 < codes[1]

def test_the_others_have_a_good_one(aero_target, aero_hand):
    aero_hand.command_codes([30000] * 7)
    aero_target.clock.sleep_until(aero_target.clock.now() + 1.0)
    assert aero_hand.read_codes()[2] > 25000
"""


def test_a_test_with_faults_has_a_hand_of_its_own(pytester):
    pytester.makepyfile(WITH_FAULTS)
    pytester.runpytest().assert_outcomes(passed=2)


def test_a_fault_that_never_fired_fails_its_test(pytester):
    pytester.makepyfile(WITH_FAULTS.replace('"motor_dead:ring"', '"motor_dead:ring", "boot_text@60"'))
    result = pytester.runpytest()
    result.assert_outcomes(passed=2, errors=1)
    result.stdout.fnmatch_lines(["*FaultNeverFiredError: never fired: boot_text*"])


def test_a_fault_that_does_not_exist_is_a_usage_error(pytester):
    pytester.makepyfile(WITH_FAULTS.replace("motor_dead", "motor_deaf"))
    result = pytester.runpytest()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert "there is no fault 'motor_deaf'" in result.stderr.str()


def test_in_any_order_presence_comes_first_and_homing_last(pytester):
    pytester.makepyfile("""
        import pytest

        @pytest.mark.homes
        def test_homes():
            pass

        def test_ordinary():
            pass

        @pytest.mark.presence
        def test_presence():
            pass
    """)
    listed = pytester.runpytest("--collect-only", "-q", "-p", "no:randomly").outlines
    assert [line.partition("::")[2] for line in listed[:3]] == ["test_presence", "test_ordinary", "test_homes"]


LEFT_OUT = """
import pytest

@pytest.mark.takes_long
@pytest.mark.parametrize("name", ["first", "second"])
def test_takes_its_time(aero_target, name):
    pass

@pytest.mark.homes
def test_homes(aero_target):
    pass

def test_reads(aero_target):
    pass

@pytest.mark.skip(reason="another reason")
def test_other(aero_target):
    pass
"""


def test_the_summary_says_what_was_left_out_and_which_flag_runs_it(pytester):
    pytester.makepyfile(LEFT_OUT)
    result = pytester.runpytest("--hil=pty")
    result.assert_outcomes(passed=1, skipped=4)
    result.stdout.fnmatch_lines(
        [
            "*aero-hil: left out*",
            "2: takes long in real time; run with --hil-long",
            "    test_takes_its_time[[]first], test_takes_its_time[[]second]",
            "1: drives the hand into its stops; run with --hil-homing",
            "    test_homes",
        ]
    )
    assert "another reason" not in result.stdout.str()


def test_a_session_in_which_everything_ran_says_nothing_of_it(run):
    assert "left out" not in run().stdout.str()
