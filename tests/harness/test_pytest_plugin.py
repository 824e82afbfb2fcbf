"""The plugin as an installed project registers it: options, header, fixtures, and what it says when it is wrong."""

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.pty_process import serve_in_child

pytest_plugins = ["pytester"]
ROOT = Path(__file__).parents[2]

ONE_TEST = """
def test_reads(aero_hand, aero_target):
    assert aero_hand.read_codes().shape == (7,)
    assert aero_target.port == {!r}
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
    result = run("--hil=pty", "--hil-side=left", "--hil-firmware=0.1.5", "--hil-seed=4", target="pty")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["aero-hil: left hand on pty, firmware 0.1.5, unit reference, seed 4"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--hil-firmware=9.9", "unknown firmware '9.9'"),
        ("--hil-unit=golden", "unknown unit 'golden'"),
        ("--hil=/dev/ttyNoSuchHand", "no hand at '/dev/ttyNoSuchHand'"),
        ("--hil=/dev/ttyACM0 -n 2", "run without -n"),
        ("--hil=loop://", "this line only echoes what is sent"),
    ],
)
def test_an_impossible_hand_is_a_usage_error_in_one_line(run, options, message):
    result = run(*options.split())
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    (line,) = [line for line in result.errlines + result.outlines if line.startswith("ERROR")]
    assert message in line


def test_a_session_without_a_hand_opens_and_shows_none(pytester):
    pytester.makepyfile("def test_nothing():\n    pass")
    result = pytester.runpytest("--hil=/dev/ttyNoSuchHand")
    result.assert_outcomes(passed=1)
    assert "right hand on" not in result.stdout.str()


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


def test_a_hand_that_fails_the_presence_test_is_not_tested_further(pytester):
    pytester.makepyfile(SUITE.format(there=False))
    result = pytester.runpytest("-rs")
    result.assert_outcomes(failed=1, skipped=5)
    result.stdout.fnmatch_lines(["*this hand failed test_presence; mend that first*"])


def test_the_junit_report_says_which_hand_it_was(pytester):
    pytester.makepyfile(SUITE.format(there=True))
    pytester.runpytest("--hil-seed=6", "--junitxml=report.xml").assert_outcomes(passed=6)
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


MARKED = """
import pytest

RING = pytest.mark.fault("motor_dead:ring")

def has_it(target):
    assert [str(fault) for fault in target.wrong] == ["motor_dead:ring=1.0"]
"""
MARKED_PLACES = {
    "parameter": """
@pytest.mark.parametrize("number", [pytest.param(1, marks=RING), 2])
def test_one(aero_target, number):
    assert (number == 1) == bool(aero_target.wrong)
""",
    "module": """
pytestmark = RING
def test_one(aero_target):
    has_it(aero_target)
""",
    "collection hook": """
def test_hooked(aero_target):
    has_it(aero_target)
""",
    "asked for at run time": """
@RING
def test_one(request):
    has_it(request.getfixturevalue("aero_target"))
""",
}
HOOK = """
import pytest

@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    for item in items:
        if "hooked" in item.name:
            item.add_marker(pytest.mark.fault("motor_dead:ring"))
"""


@pytest.mark.parametrize("place", MARKED_PLACES)
def test_a_mark_counts_from_wherever_pytest_takes_marks(pytester, place):
    pytester.makeconftest(HOOK)
    pytester.makepyfile(MARKED + MARKED_PLACES[place])
    result = pytester.runpytest("--junitxml=report.xml")
    result.assert_outcomes(passed=2 if place == "parameter" else 1)
    report = (pytester.path / "report.xml").read_text()
    assert report.count('name="hil_faults" value="motor_dead:ring=1.0"') == 1


def test_what_a_test_does_to_its_hand_is_reported_and_undone_for_the_next(pytester):
    pytester.makepyfile(
        """
        def test_breaks_it(aero_target):
            aero_target.inject("motor_dead:ring")
            aero_target.act("exchange_servos ring pinky")
            aero_target.act("cable_off index")
            assert str(aero_target.wrong[0]) == "motor_dead:pinky=1.0"

        def test_has_a_good_one(aero_target):
            assert aero_target.wrong == ()
            aero_target.act("cable_off index")
        """
    )
    pytester.runpytest("--junitxml=report.xml").assert_outcomes(passed=2)
    report = (pytester.path / "report.xml").read_text()
    assert report.count('name="hil_acts"') == 2
    assert " s: injected motor_dead:ring=1.0; " in report


def test_a_mark_that_comes_when_the_hand_is_open_fails_the_test(pytester):
    pytester.makepyfile(
        """
        import pytest

        def test_one(aero_target, request):
            request.node.add_marker(pytest.mark.fault("motor_dead:ring"))
        """
    )
    result = pytester.runpytest("--junitxml=report.xml")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*motor_dead:ring*came when the hand was open already*"])
    assert "hil_faults" not in (pytester.path / "report.xml").read_text()


def test_waiting_in_which_an_emulated_hand_stands_still_fails_the_test(pytester):
    pytester.makepyfile(
        """
        import asyncio, os, subprocess, sys, threading, time
        from time import sleep

        import pytest

        asyncio.run(asyncio.sleep(0))  # loads what a test would wait for

        @pytest.fixture
        def rested(aero_hand):
            sleep(0.1)
            return aero_hand

        @pytest.fixture(scope="module")
        def server():
            time.sleep(0.1)

        def test_by_the_module(aero_hand):
            time.sleep(0.1)

        def test_by_its_name(aero_target):
            sleep(0.1)

        def test_of_the_session(aero_session_target):
            sleep(0.1)

        def test_by_asyncio(aero_hand):
            asyncio.run(asyncio.sleep(0.1))

        def test_by_an_event(aero_hand):
            threading.Event().wait(0.1)

        def test_in_a_fixture(rested):
            pass

        def test_asked_for(request):
            request.getfixturevalue("aero_hand")
            sleep(0.1)

        def test_that_fails(aero_hand):
            time.sleep(0.1)
            assert not aero_hand

        def test_by_the_clock(aero_target, aero_hand):
            aero_target.clock.sleep_until(aero_target.clock.now() + 2.0)

        def test_that_calls_a_program(aero_target, aero_hand):
            aero_hand.command_codes([20000] * 7)
            aero_target.clock.sleep_until(aero_target.clock.now() + 0.5)
            subprocess.run([sys.executable, "-c", "import time; time.sleep(1)"], check=True)

        def test_with_a_disk_read(aero_hand, tmp_path):
            with open(tmp_path / "page", "wb") as file:
                file.write(bytes(4096))
                os.fsync(file.fileno())
                os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
            (tmp_path / "page").read_bytes()
            time.sleep(1.0)  # a busy machine reads more pages than this one, and each may have taken its time

        def test_that_computes(aero_hand):
            end = time.process_time() + 0.2
            while time.process_time() < end:
                pass

        def test_beside_a_server(server, aero_session_target):
            pass

        def test_without_a_hand():
            time.sleep(0.1)
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(passed=5, failed=9)
    assert result.stdout.str().count("use `aero_target.clock.sleep_until") == 9


LIFETIMES = {
    "fixture that clears": """
        @pytest.fixture
        def dead(aero_target):
            aero_target.inject("motor_dead:ring")
            yield
            assert names(aero_target) == ["motor_dead"]
            aero_target.clear("motor_dead:ring")

        @pytest.mark.parametrize("time", range(2))
        def test_dead(dead, aero_target, time):
            assert names(aero_target) == ["motor_dead"]
    """,
    "later fixture that skips": """
        @pytest.fixture
        def dead(aero_target):
            aero_target.inject("motor_dead:ring")
            aero_target.act("cable_off index")

        @pytest.fixture
        def skips(dead):
            pytest.skip()

        @pytest.fixture
        def fails(dead):
            raise RuntimeError

        def test_skipped(skips):
            pass

        def test_sound(aero_target):
            assert names(aero_target) == []

        def test_error(fails):
            pass

        def test_sound_again(aero_target):
            assert names(aero_target) == []
            aero_target.act("cable_off index")
    """,
    "module's fixture": """
        @pytest.fixture(scope="module")
        def dead(aero_session_target):
            aero_session_target.inject("motor_dead:ring")
            aero_session_target.act("cable_off index")

        @pytest.mark.parametrize("time", range(3))
        def test_dead(dead, aero_target, time):
            assert names(aero_target) == ["motor_dead"]
            aero_target.inject("motor_weak:index")
            aero_target.clear("motor_dead:ring")
    """,
    "exchange": """
        @pytest.fixture(scope="module")
        def exchanged(aero_session_target):
            if aero_session_target.real_time:
                pytest.skip("restarts the board, which ends the link")
            aero_session_target.act("exchange_servos index middle")

        def test_dead(exchanged, aero_target):
            aero_target.inject("motor_dead:ring")
            aero_target.act("exchange_servos ring pinky")
            assert [str(fault) for fault in aero_target.wrong] == ["motor_dead:pinky=1.0"]
    """,
    "test of the session's hand": """
        def test_dead(aero_session_target):
            aero_session_target.inject("motor_dead:ring")
    """,
    "fixture made in a test": """
        @pytest.fixture(scope="module")
        def dead(aero_session_target):
            aero_session_target.inject("motor_dead:ring")

        def test_asks(request, aero_target):
            aero_target.inject("motor_weak:index")
            request.getfixturevalue("dead")

        def test_dead(aero_target):
            assert names(aero_target) == ["motor_dead"]
    """,
}
OUTCOMES = {"later fixture that skips": {"passed": 3, "skipped": 1, "errors": 1}}


@pytest.mark.parametrize("way", LIFETIMES)
@pytest.mark.parametrize("target", ["emulated", pytest.param("pty", marks=pytest.mark.slow)])
def test_a_fault_lives_as_long_as_the_fixture_or_the_test_that_injected_it(pytester, way, target):
    begin = "import pytest\n\ndef names(target):\n    return [fault.name for fault in target.wrong]\n"
    after = "def test_sound(aero_target):\n    assert aero_target.wrong == ()"
    pytester.makepyfile(test_1=begin + textwrap.dedent(LIFETIMES[way]), test_2=after)
    result = pytester.runpytest(f"--hil={target}", "-p", "no:randomly", "--junitxml=report.xml")
    expected = (
        {"passed": 1, "skipped": 1}
        if (way, target) == ("exchange", "pty")
        else OUTCOMES.get(way, {"passed": LIFETIMES[way].count("def test_") + 1})
    )
    extra = {"module's fixture": 2, "fixture that clears": 1}.get(way, 0)
    result.assert_outcomes(**{**expected, "passed": expected["passed"] + extra})


def test_a_wider_fixture_that_takes_the_functions_is_told_the_sessions(pytester):
    pytester.makepyfile(
        """
        import pytest

        @pytest.fixture(scope="module")
        def rig(aero_target):
            return aero_target

        def test_rig(rig):
            pass
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["*takes `aero_session_target` in place of `aero_target`"])


def test_an_act_skips_on_a_port_as_the_mark_does(pytester):
    pytester.makepyfile(
        """
        import pytest

        def test_acts(aero_target):
            aero_target.inject("motor_dead:ring")

        @pytest.mark.fault("motor_dead:ring")
        def test_marked(aero_target):
            pass

        def test_sound(aero_target):
            assert aero_target.wrong == ()
        """
    )
    with serve_in_child(EmulatedSpec()) as (port, _):
        result = pytester.runpytest(f"--hil={port}", "-rs")
    result.assert_outcomes(passed=1, skipped=2)
    assert result.stdout.str().count("its faults are for an emulated hand") == 2


def test_a_hand_that_still_moves_comes_to_rest_before_the_next_test(pytester):
    pytester.makepyfile(
        """
        import pytest

        def test_moves(aero_hand):
            aero_hand.command_codes([60000] * 7)

        def test_rests(aero_target):
            assert max(abs(aero_target.hand.read_speeds())) < 0.2
            assert min(aero_target.hand.read_codes()) > 50000

        def test_restarts(aero_target):
            aero_target.act("power_off")

        def test_answers(aero_target):
            assert max(abs(aero_target.hand.read_speeds())) < 0.2
        """
    )
    pytester.runpytest("-p", "no:randomly").assert_outcomes(passed=4)


def test_the_plugin_uses_no_private_name_of_pytest():
    for name in ("aero_hil_pytest", "aero_hil_options", "feetech_robots/src/feetech_robots/pytest_plugin"):
        text = (ROOT / f"{name}.py").read_text(encoding="utf-8")
        assert not re.search(r"_pytest\.|\b(?!self\b)\w+\._[a-z]", text), name


def test_a_fault_that_never_fired_fails_its_test(pytester):
    pytester.makepyfile(WITH_FAULTS.replace('"motor_dead:ring"', '"motor_dead:ring", "boot_text@60"'))
    result = pytester.runpytest()
    result.assert_outcomes(passed=2, errors=1)
    result.stdout.fnmatch_lines(["*FaultNeverFiredError: never fired: boot_text*"])


def test_a_fault_that_does_not_exist_is_a_usage_error(pytester):
    pytester.makepyfile(WITH_FAULTS.replace("motor_dead", "motor_deaf"))
    result = pytester.runpytest()
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert "unknown fault 'motor_deaf'" in result.stderr.str()


def test_in_any_order_presence_comes_first_and_homing_last(pytester):
    pytester.makepyfile("""
        import pytest

        @pytest.mark.homes
        def test_homes(aero_target):
            pass

        def test_of_another_kind():
            pass

        def test_ordinary(aero_target):
            pass

        @pytest.mark.presence
        def test_presence(aero_target):
            pass
    """)
    listed = pytester.runpytest("--collect-only", "-q", "-p", "no:randomly").outlines
    assert [line.partition("::")[2] for line in listed if "::" in line] == [
        "test_presence",
        "test_of_another_kind",
        "test_ordinary",
        "test_homes",
    ]


RIG = {
    "conftest.py": """
import pytest

def pytest_addoption(parser):
    parser.addoption("--hil", action="store_true", help="run on the rig")
    parser.addoption("--hil-seed", default="theirs")
    parser.addoption("--bus-robot", default="theirs")

def pytest_configure(config):
    for mark in ("fault", "presence", "homes", "robot"):
        config.addinivalue_line("markers", f"{mark}: of the rig")
""",
    "hil/__init__.py": "",
    "hil/rig.py": "VOLTS = 24",
    "tests/model.py": "MASS = 3",
    "tests/test_rig.py": """
import model, pytest
from hil.rig import VOLTS

@pytest.mark.homes
def test_homes(request):
    assert (model.MASS, VOLTS) == (3, 24)
    assert request.config.getoption("--hil") is True
    assert request.config.getoption("--hil-seed") == request.config.getoption("--bus-robot") == "theirs"

@pytest.mark.robot
@pytest.mark.fault(3, what="a fault of the rig")
def test_fault():
    pass

@pytest.mark.presence
@pytest.mark.parametrize("number", range(5))
def test_presence(number):
    pass
""",
}
NEIGHBOURS = ["--randomly-seed=3", "--timeout=60", "--asyncio-mode=strict"]
"""Plugins that tox puts into the folder PYTEST_NEIGHBOURS, with an option of each."""


FEETECH = "feetech_robots.pytest_plugin"
PLUGINS = {"aero_hil_pytest": [], FEETECH: ["-p", FEETECH]}
"""Plugin to the arguments that load it here."""


@pytest.fixture(autouse=True)
def feetech_robots(monkeypatch):
    """The distribution beside this one, installed or not."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "feetech_robots" / "src"), prepend=os.pathsep)


@pytest.fixture
def rig(pytester):
    """Another project; returns what runs its tests and returns what is printed, without times."""
    for name, text in RIG.items():
        (pytester.path / name).parent.mkdir(exist_ok=True)
        (pytester.path / name).write_text(text)

    def lines(*arguments, **environment):
        command = [sys.executable, "-m", "pytest", "-v", "--hil", "-p", "no:cacheprovider", *arguments]
        done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        shown = re.sub(r"in \d+\.\d+s|\[gw\d\]|\[ *\d+%\]|plugins: .*", "", done.stdout + done.stderr)
        return [line.strip(" =") for line in shown.splitlines()]

    return lines


@pytest.mark.parametrize(
    "beside", [pytest.param("nothing", marks=pytest.mark.slow), pytest.param("xdist", marks=pytest.mark.slow), "others"]
)
def test_a_project_that_never_uses_us_runs_as_without_us(rig, pytester, beside):
    """Its own package `hil`, module `model`, option `--hil` and marks, all at once, beside NEIGHBOURS too."""
    arguments, environment = {"nothing": ([], {}), "xdist": (["-n", "1"], {})}.get(beside, (NEIGHBOURS, {}))
    if arguments is NEIGHBOURS:
        if "PYTEST_NEIGHBOURS" not in os.environ:
            pytest.skip("needs PYTEST_NEIGHBOURS, a folder with pytest-randomly, pytest-timeout and pytest-asyncio")
        environment = {"PYTHONPATH": os.pathsep.join((os.environ["PYTEST_NEIGHBOURS"], os.environ["PYTHONPATH"]))}
    without, with_us = (
        rig(*arguments, *more, **environment) for more in (["-p", "no:aero_hil_pytest"], PLUGINS[FEETECH])
    )
    extra = [line for line in with_us if line not in without]
    assert [line for line in without if line not in with_us] == []
    assert sorted(line.partition(" is disabled: ")[0] for line in extra) == ["aero-hil", "feetech-robots"]
    assert all(f"{pytester.path}/hil/__init__.py has the name of aero-hil's" in line for line in extra)


@pytest.mark.parametrize("how", ["entry point", "-p", "conftest", "conftest alone"])
def test_the_plugin_is_the_same_however_it_is_named(pytester, monkeypatch, how):
    """Twice is once, and its options are there also where pytest loads nothing by itself."""
    pytester.makepyfile(
        f"""
        def test_one(request):
            assert request.config.getoption("--aero-hil-seed") == 3
            if {how == "conftest alone"}:
                assert request.getfixturevalue("aero_target").seed == 3
        """
    )
    if "conftest" in how:
        pytester.makeconftest(f"pytest_plugins = {list(PLUGINS)}")
    if how == "conftest alone":
        monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    named = ["-p", "aero_hil_pytest"] if how == "-p" else []
    result = pytester.runpytest_subprocess("--hil=emulated", "--aero-hil-seed=3", *named)
    result.assert_outcomes(passed=1)


def test_the_plugin_of_robots_beside_an_own_package_hil_option_and_mark(pytester):
    pytester.makeconftest(
        f"""
        import pytest

        pytest_plugins = ["{FEETECH}"]

        def pytest_addoption(parser):
            parser.addoption("--bus-robot", action="store_true")

        @pytest.fixture
        def of_both(bus_target):
            return bus_target
        """
    )
    pytester.makepyfile(
        **{
            "hil/__init__": "HERE = True",
            "test_theirs": """
                import hil, pytest

                @pytest.mark.robot
                def test_theirs(request):
                    assert hil.HERE
                    assert request.config.getoption("--bus-robot") is True
                    assert request.config.getoption("--aero-bus-robot") is None
            """,
        }
    )
    result = pytester.runpytest_subprocess("--bus-robot", *PLUGINS[FEETECH])
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["feetech-robots is disabled: */hil/__init__.py has the name of aero-hil's*"])


def test_a_bare_mark_robot_is_refused_in_one_line_by_the_fixture_that_reads_it(pytester):
    pytester.makepyfile("import pytest\n\n@pytest.mark.robot\ndef test_one(bus_target): pass")
    pytester.syspathinsert(ROOT / "feetech_robots" / "src")
    result = pytester.runpytest(*PLUGINS[FEETECH])
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["bus_target needs a robot: mark the test with `robot(PATH)`, or *"])


def test_an_option_that_the_project_has_is_the_projects_and_ours_has_another_name(pytester):
    pytester.makeconftest("def pytest_addoption(parser):\n    parser.addoption('--hil', action='store_true')")
    pytester.makepyfile(
        """
        def test_reads(aero_target, request):
            assert request.config.getoption("--hil") is True
            assert aero_target.port == "emulated"
            assert aero_target.seed == 4
        """
    )
    result = pytester.runpytest("--hil", "--aero-hil=emulated", "--hil-seed=4")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["aero-hil: --hil is this project's own; aero-hil's is --aero-hil"])


def test_a_module_beside_a_test_that_hides_ours_is_named_in_one_line(pytester):
    pytester.makepyfile(model="", test_reads="def test_reads(aero_target):\n    pass")
    result = pytester.runpytest_subprocess("-p", "no:hypothesispytest")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    (line,) = [line for line in result.errlines + result.outlines if line.startswith("ERROR")]
    assert f"{pytester.path}/model.py has the name of aero-hil's package `model`" in line


def test_a_package_serial_beside_a_test_is_named_and_not_an_extra(pytester):
    pytester.makepyfile(serial="", test_reads="def test_reads(aero_target):\n    pass")
    result = pytester.runpytest_subprocess("-p", "no:hypothesispytest")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    (line,) = [line for line in result.errlines + result.outlines if line.startswith("ERROR")]
    assert f"{pytester.path}/serial.py is not the package `serial` that aero-hil needs" in line
    assert "suite" not in line


def test_a_module_beside_a_program_does_not_reach_the_child_that_serves_a_hand(pytester):
    pytester.makepyfile(test_reads="def test_reads(aero_target):\n    aero_target.hand.read_codes()")
    pytester.mkdir("other")
    for module in ("model", "train", "hil"):
        (pytester.path / f"other/{module}.py").write_text("raise SystemError")
    command = [sys.executable, "-P", "-m", "pytest", "--hil=pty", "--rootdir=..", "../test_reads.py"]
    done = subprocess.run(command, cwd=pytester.path / "other", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_marks_of_other_tests_mean_what_their_project_says(pytester):
    pytester.makepyfile(
        """
        import pytest

        @pytest.fixture
        def aero_target():
            return 3

        @pytest.mark.homes
        def test_homes(aero_target):
            assert aero_target == 3

        @pytest.mark.fault(3, what="of ours")
        def test_fault(aero_target):
            pass

        @pytest.mark.presence
        def test_presence():
            assert False

        def test_ordinary():
            pass
        """
    )
    result = pytester.runpytest("-v")
    result.assert_outcomes(passed=3, failed=1)
    run = [line.split()[0].partition("::")[2] for line in result.outlines if "::" in line and "%]" in line]
    assert run == ["test_homes", "test_fault", "test_presence", "test_ordinary"]


@pytest.mark.slow
def test_one_worker_of_xdist_uses_the_port_and_says_what_it_skips(pytester):
    pytester.makepyfile(SUITE.format(there=True))
    with serve_in_child(EmulatedSpec()) as (port, _):
        result = pytester.runpytest_subprocess(f"--hil={port}", "-n", "1", "--hil-still", "-rs")
    result.assert_outcomes(passed=2, skipped=4)
    result.stdout.fnmatch_lines(["*run without --hil-still*"])


@pytest.fixture(scope="module")
def network_hand():
    """`aero-hil emulate --listen`, at its URL."""
    command = [sys.executable, "-P", "-m", "hil.cli", "emulate", "--listen", "127.0.0.1:0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        yield server.stdout.readline().split()[1]
        server.terminate()


def test_a_hand_on_the_network_is_tested(pytester, network_hand):
    pytester.makepyfile(ONE_TEST.format(network_hand))
    result = pytester.runpytest(f"--hil={network_hand}", "-W", "error")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines([f"aero-hil: right hand on {network_hand}, firmware 0.2.0"])


@pytest.mark.slow
def test_a_missing_hand_is_one_error_in_a_worker_too(pytester):
    pytester.makepyfile(SUITE.format(there=True))
    result = pytester.runpytest_subprocess("--hil=/dev/ttyNoSuchHand", "-n", "1")
    result.assert_outcomes(errors=1, skipped=5)
    result.stdout.fnmatch_lines(["no hand at '/dev/ttyNoSuchHand'*"])


def test_hypothesis_gives_every_example_the_hand_of_the_session(pytester):
    pytester.makepyfile(
        """
        from hypothesis import given, settings, strategies as st

        @settings(max_examples=3)
        @given(code=st.integers(0, 100))
        def test_codes(aero_session_target, code):
            aero_session_target.hand.command_codes([code] * 7)
        """
    )
    pytester.runpytest().assert_outcomes(passed=1)


TIMES_OUT = """
import signal, sys
import pytest
from hil.emulated.faults.bench import HandBench

LINES = 3000

def leave(*_):
    pytest.fail("timed out")

@pytest.fixture(params=[lambda: signal.raise_signal(signal.SIGALRM), leave], ids=["signal", "thread"])
def times_out(request):
    # at a line of the emulator: of a signal, as of pytest-timeout, or of an exception that another thread has set
    left = LINES
    def trace(frame, event, _argument):
        nonlocal left
        if "firmware_emulator" not in frame.f_code.co_filename and "workbench" not in frame.f_code.co_filename:
            return None
        left -= event == "line"
        if left == 0:
            request.param()
        return trace
    before = signal.signal(signal.SIGALRM, leave)
    yield lambda: sys.settrace(trace)
    sys.settrace(None)
    signal.signal(signal.SIGALRM, before)

def test_moves(aero_target, times_out):
    times_out()
    while True:
        aero_target.hand.command_codes([60000] * 7)
        aero_target.clock.sleep_until(aero_target.clock.now() + 0.1)

def test_acts(aero_target, times_out):
    bench = aero_target.bench
    times_out()
    while True:
        bench.act("power_off")
        bench.act("power_on")
        aero_target.clock.sleep_until(aero_target.clock.now() + 0.1)

def test_answers(aero_hand):
    assert max(aero_hand.read_codes()) < 3000
"""


def test_a_test_that_runs_into_its_time_out_spoils_no_other(pytester):
    """All later tests of a session were errors once, in 3 of 8 sessions."""
    pytester.makepyfile(TIMES_OUT)
    result = pytester.runpytest("-p", "no:randomly")
    result.assert_outcomes(failed=4, passed=1)
    assert result.stdout.str().count("timed out") >= 4


@pytest.mark.parametrize("workers", [[], pytest.param(["-n", "1"], marks=pytest.mark.slow)], ids=["alone", "worker"])
def test_an_opengl_that_cannot_be_loaded_is_one_line(workers, pytester, monkeypatch):
    pytester.makepyfile(ONE_TEST.format("emulated"))
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    result = pytester.runpytest_subprocess(*workers)
    said = result.stdout.str() + result.stderr.str()
    if "1 passed" in said:
        pytest.skip("this computer has OSMesa")
    assert "MUJOCO_GL=osmesa: MuJoCo cannot load this OpenGL here" in said
    assert "INTERNALERROR" not in said
