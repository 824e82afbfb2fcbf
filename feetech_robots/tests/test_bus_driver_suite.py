"""The suite for drivers of the servo bus: how it is called, what it prints, and that it can fail."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest_plugins = ["pytester"]
ROOT = Path(__file__).parents[1]
SHORTEST_LINES = 20

DRIVER = "def factory(port, servos):\n    return port, servos\n"
TESTS = """
import pytest

def test_what_is_right(bus_driver_factory):
    assert bus_driver_factory("port", {1: "STS3215"}) == ("port", {1: "STS3215"})

def test_what_is_wrong(bus_driver_factory):
    assert False

def test_what_it_lacks(bus_driver_factory):
    pytest.skip("not offered")
"""


def test_the_run_ends_with_a_table(pytester):
    pytester.makepyfile(my_driver=DRIVER, test_suite=TESTS)
    pytester.syspathinsert()
    result = pytester.runpytest("--bus-driver=my_driver:factory")
    result.assert_outcomes(passed=1, failed=1, skipped=1)
    result.stdout.fnmatch_lines(
        [
            "*feetech-robots: bus driver my_driver:factory*",
            "right       what is right",
            "WRONG       what is wrong",
            "not offered what it lacks",
        ]
    )


def test_without_a_driver_the_suite_is_skipped_with_the_flag_that_runs_it(pytester):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest("-rs")
    result.assert_outcomes(skipped=3)
    result.stdout.fnmatch_lines(["*run with --bus-driver=my_package.my_module:factory*"])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("driver", "name a factory as"),
        ("no_such:factory", "No module named"),
        ("json:factory", "no attribute 'factory'"),
    ],
)
def test_a_driver_that_cannot_be_loaded_is_a_usage_error(pytester, name, message):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest(f"--bus-driver={name}")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert message in result.stderr.str()


def test_each_failure_has_a_script_of_at_most_twenty_lines():
    scripts = sorted((ROOT / "examples/bus_drivers/failures").glob("*.py"))
    page = (ROOT / "docs/bus_drivers.md").read_text()
    assert len(scripts) == 5
    for script in scripts:
        assert f"`{script.stem}`" in page
        assert len(script.read_text().splitlines()) <= SHORTEST_LINES


@pytest.mark.slow
def test_the_suite_finds_that_feetech_servo_sdk_takes_late_answers():
    command = [sys.executable, "-m", "pytest", "tests/bus_driver", "-p", "no:cacheprovider", "-k", "late or scs"]
    command += ["--bus-driver=bus_drivers.feetech_servo_sdk:Driver"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    table = [line for line in done.stdout.splitlines() if line.startswith(("right", "WRONG", "not offered"))]
    assert table == [
        "right       two byte registers of an scs servo are read and written",
        "right       a late answer is not taken for another servos",
        "WRONG       a late answer is not taken for the next register",
        "WRONG       a late sync read does not shift the next",
    ]


@pytest.mark.slow
def test_the_shortest_script_shows_the_late_answer():
    script = ROOT / "examples/bus_drivers/failures/feetech_late_answer.py"
    done = subprocess.run([sys.executable, str(script)], cwd=ROOT, capture_output=True, text=True, check=False)
    # On a loaded machine a later read may be lost too.
    assert done.stdout.splitlines()[:2] == ["result of the late read: -6", "goal speed, 222: 1111"]
