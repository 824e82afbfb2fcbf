"""The pytest plugin behind `pytest --hil=TARGET`.

Registered as an entry point, so that it is there wherever this project is installed. It adds the options, the fixtures
`aero_target` and `aero_hand`, and, in a session that uses them, one line that says which hand is tested. Everything
heavy is imported when a test first asks for a hand.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from aero.firmware import DEFAULT_FIRMWARE

if TYPE_CHECKING:
    from aero.hand import Hand
    from hil.faults.fault import Fault
    from hil.targets.bus_driver import Factory
    from hil.targets.robot_bus import RobotBus
    from hil.targets.target import Target

IN_SOFTWARE = ("emulated", "pty")
"""Targets that need no hardware, and that any number of test processes may open at once."""
DEFAULTS = {"--hil-firmware": DEFAULT_FIRMWARE, "--hil-unit": "reference"}
"""What is known to exist without looking."""
REST_WAIT_S, REST_TRIES = 0.2, 15
"""How often an opening hand is looked at, s, and how many times at most."""
REST_RAD_S = 0.2
"""Shaft speed below which a hand is at rest."""

MARKERS = (
    "presence: a hand that fails this test is not tested further",
    "moves: moves the hand; skipped with --hil-still",
    "homes: drives the hand into its stops; on a hand in real time only with --hil-homing",
    "takes_long: takes more than a few seconds of hand time; in real time only with --hil-long",
    "needs_ground_truth: compares with what an emulated hand really does, hil.GroundTruth",
    "robot(path): the robot behind the fixture `bus_target`, a TOML file, relative to the test's",
    "fault(text, ...): gets an emulated hand of its own with these faults, NAME[:CHANNEL][=SEVERITY][@SECONDS]",
)

_TARGET = pytest.StashKey["Target"]()
_LEFT_OUT = "hil_left_out"
"""Property of a test that was left out, with the reason and the flag that runs it."""
_FAILED = pytest.StashKey[str]()
"""Name of the presence test that failed."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--hil` and the options that say which hand it is."""
    group = parser.getgroup("aero-hil", "Aero Hand Open")
    group.addoption(
        "--hil",
        metavar="TARGET",
        default="emulated",
        help="hand to test: emulated (default; virtual time), pty (real time), or the path or pyserial URL of a port",
    )
    group.addoption(
        "--hil-firmware",
        metavar="VERSION",
        default=DEFAULTS["--hil-firmware"],
        help="firmware of the hand (default 0.2.0)",
    )
    group.addoption("--hil-hand", choices=("right", "left"), default="right", help="side (default right)")
    group.addoption(
        "--hil-unit",
        metavar="UNIT",
        default=DEFAULTS["--hil-unit"],
        help="emulated unit: shipped name or .toml (default reference)",
    )
    group.addoption("--hil-still", action="store_true", help="skip tests that move the hand")
    group.addoption("--hil-homing", action="store_true", help="also run tests that home a hand in real time")
    group.addoption("--hil-long", action="store_true", help="also run tests that take long in real time")
    group.addoption(
        "--bus-driver",
        metavar="FACTORY",
        help="driver of the servo bus to test: my_package.my_module:factory",
    )
    group.addoption("--bus-robot", metavar="PATH", help="robot behind the fixture bus_target, a TOML file")
    group.addoption("--hil-seed", type=int, default=0, help="seed of the emulated hand's noise (default 0)")


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers, and refuse options that cannot work before any test process starts."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    name = config.getoption("--hil")
    if name not in IN_SOFTWARE and getattr(config.option, "numprocesses", None):
        raise pytest.UsageError(f"--hil={name}: one program at a time can use a hand; run without -n")
    if (driver := config.getoption("--bus-driver")) is not None:
        from hil.targets.bus_driver import driver_factory  # noqa: PLC0415 - only this suite needs it

        try:
            driver_factory(driver)
        except ValueError as error:
            raise pytest.UsageError(str(error)) from error
    if any(config.getoption(option) != default for option, default in DEFAULTS.items()):
        _opener(config)


def pytest_report_collectionfinish(config: pytest.Config, items: list[pytest.Item]) -> str | list[str]:
    """Say which hand will be tested, in a session that tests one."""
    if not any(_uses_a_hand(item) for item in items):
        return []
    option = config.getoption
    unit = f", unit {option('--hil-unit')}, seed {option('--hil-seed')}" if option("--hil") in IN_SOFTWARE else ""
    return f"aero-hil: {option('--hil-hand')} hand on {option('--hil')}, firmware {option('--hil-firmware')}{unit}"


def pytest_collection_finish(session: pytest.Session) -> None:
    """Open a physical hand before the first test, so that a missing one is one error and not one for every test."""
    config = session.config
    if config.getoption("collectonly") or not any(_uses_a_hand(item) for item in session.items):
        return
    from hil.targets.target import NoHandError  # noqa: PLC0415 - loads a physics engine

    opened = ExitStack()
    try:
        config.stash[_TARGET] = opened.enter_context(_opener(config))
    except NoHandError as error:
        raise pytest.UsageError(str(error)) from error
    config.add_cleanup(opened.close)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the presence tests first and those that home last, whose zero stays; refuse faults that do not exist."""
    for item in items:
        try:
            _faults(item)
        except ValueError as error:
            raise pytest.UsageError(f"{item.nodeid}: {error}") from error
    items.sort(
        key=lambda item: (item.get_closest_marker("presence") is None, item.get_closest_marker("homes") is not None)
    )


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what this hand cannot or must not do, with the reason, and record which hand it is."""
    if not _uses_a_hand(item):
        return
    target = item.config.stash[_TARGET]
    faults = _faults(item)
    if faults and target.name not in IN_SOFTWARE:
        pytest.skip("its faults are put into an emulated hand; run with --hil=emulated, or see `aero-hil proxy`")
    if reason := _reason_to_skip(item, target):
        item.user_properties.append((_LEFT_OUT, reason))
        pytest.skip(reason)
    for name, value in _properties(target).items():
        item.user_properties.append((f"hil_{name}", value))
    if faults:
        item.user_properties.append(("hil_faults", " ".join(map(str, faults))))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Remember a presence test that failed."""
    report = yield
    if report.failed and item.get_closest_marker("presence"):
        item.config.stash[_FAILED] = item.name
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say what of the suite was left out, why, and which flag runs it."""
    _bus_driver_table(terminalreporter)
    left_out: dict[str, list[str]] = {}
    for report in terminalreporter.stats.get("skipped", []):
        # A module that is skipped while it is collected has a report without properties.
        properties = getattr(report, "user_properties", ())
        for reason in (value for name, value in properties if name == _LEFT_OUT):
            left_out.setdefault(reason, []).append(report.nodeid.rpartition("::")[2])
    if not left_out:
        return
    terminalreporter.section("aero-hil: left out")
    for reason, names in left_out.items():
        terminalreporter.line(f"{len(names)}: {reason}")
        terminalreporter.line(f"    {', '.join(names)}")


@pytest.fixture
def aero_target(request: pytest.FixtureRequest) -> Iterator[Target]:
    """The hand chosen by `--hil`, see `hil.Target`: one for the session, and one of its own for a test with faults."""
    faults = _faults(request.node)
    if not faults:
        yield request.config.stash[_TARGET]
        return
    with _opener(request.config, faults) as target:
        yield target


@pytest.fixture
def aero_hand(aero_target: Target) -> Hand:
    """The driver of the target's hand, commanded open and at rest."""
    hand, clock = aero_target.hand, aero_target.clock
    hand.command_codes([0] * 7)
    for _ in range(REST_TRIES):
        clock.sleep_until(clock.now() + REST_WAIT_S)
        if all(abs(hand.read_speeds()) < REST_RAD_S):
            return hand
    pytest.fail(f"the hand does not come to rest within {REST_TRIES * REST_WAIT_S:g} s of opening")


@pytest.fixture(scope="session")
def bus_driver_factory(request: pytest.FixtureRequest) -> Factory:
    """Makes the driver of `--bus-driver`; see `hil.targets.bus_driver`."""
    from hil.targets.bus_driver import driver_factory  # noqa: PLC0415 - only this suite needs it

    name = request.config.getoption("--bus-driver")
    if name is None:
        pytest.skip("tests a driver of the servo bus; run with --bus-driver=my_package.my_module:factory")
    return driver_factory(name)


@pytest.fixture
def bus_target(request: pytest.FixtureRequest) -> RobotBus:
    """A robot of bus servos on virtual time, one for each test; which one says the mark `robot` or `--bus-robot`."""
    from hil.targets.robot_bus import RobotBus  # noqa: PLC0415 - loads a physics engine

    mark, option = request.node.get_closest_marker("robot"), request.config.getoption("--bus-robot")
    if mark is not None:
        path = request.node.path.parent / mark.args[0]
    elif option is not None:
        path = Path(option)
    else:
        pytest.fail("bus_target needs a robot: mark the test with `robot(PATH)`, or run with --bus-robot=PATH")
    try:
        return RobotBus.of_file(path, seed=request.config.getoption("--hil-seed"))
    except (ValueError, OSError) as error:
        pytest.fail(f"bus_target: {error}")


def _bus_driver_table(terminalreporter: pytest.TerminalReporter) -> None:
    """Say what a driver of the servo bus got right, one line a test."""
    name = terminalreporter.config.getoption("--bus-driver")
    if name is None:
        return
    terminalreporter.section(f"aero-hil: bus driver {name}")
    words = {"passed": "right", "failed": "WRONG", "error": "WRONG", "skipped": "not offered"}
    for outcome, word in words.items():
        for report in terminalreporter.stats.get(outcome, []):
            test = report.nodeid.rpartition("::")[2].removeprefix("test_").replace("_", " ")
            terminalreporter.line(f"{word:12}{test}")


def _uses_a_hand(item: pytest.Item) -> bool:
    return "aero_target" in getattr(item, "fixturenames", ())


def _reason_to_skip(item: pytest.Item, target: Target) -> str | None:
    option = item.config.getoption
    failed = item.config.stash.get(_FAILED, None)
    if failed is not None:
        return f"this hand failed {failed}; mend that first, or choose another hand with --hil"
    if item.get_closest_marker("moves") and option("--hil-still"):
        return "moves the hand; run without --hil-still"
    if item.get_closest_marker("homes") and target.real_time and not option("--hil-homing"):
        return "drives the hand into its stops; run with --hil-homing"
    if item.get_closest_marker("takes_long") and target.real_time and not option("--hil-long"):
        return "takes long in real time; run with --hil-long"
    if item.get_closest_marker("needs_ground_truth"):
        from hil.targets.target import GroundTruth  # noqa: PLC0415 - loads a physics engine

        if target.find(GroundTruth) is None:
            return f"{target.name} has no ground truth; run with --hil=emulated"
    return None


def _faults(item: pytest.Item) -> tuple[Fault, ...]:
    """Return the faults of a test's marks."""
    texts = [text for mark in item.iter_markers("fault") for text in mark.args]
    if not texts:
        return ()
    from hil.faults.catalogue import parse_fault  # noqa: PLC0415 - loads a physics engine

    return tuple(map(parse_fault, texts))


def _properties(target: Target) -> dict[str, str]:
    """Return what a JUnit report should say about the hand under test."""
    from hil.recordings.provenance import source_commit  # noqa: PLC0415 - loads NumPy

    return {
        "target": target.name,
        "hand": target.side,
        "firmware": target.firmware,
        "map": target.map.coefficients.name,
        "window": target.map.window.name,
        "unit": target.unit,
        "seed": str(target.seed),
        "commit": source_commit(),
    }


def _opener(config: pytest.Config, faults: Sequence[Fault] = ()) -> AbstractContextManager[Target]:
    """Return the target's context manager, not yet entered."""
    from hil.targets.opening import open_target  # noqa: PLC0415 - loads a physics engine

    option = config.getoption
    try:
        return open_target(
            option("--hil"),
            firmware=option("--hil-firmware"),
            hand=option("--hil-hand"),
            unit=option("--hil-unit"),
            seed=option("--hil-seed"),
            faults=faults,
            # As an owner's hand has been; one with faults might not come through it.
            homed=not faults and not option("--hil-still"),
        )
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error
