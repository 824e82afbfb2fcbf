"""The pytest plugin: a driver under test, `--bus-driver`, and a robot on virtual time, the fixture `bus_target`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from feetech_robots.bus_driver import Factory
    from feetech_robots.robot_bus import RobotBus

_BUS_DRIVER = "feetech_bus_driver"
"""Property of a test of a bus driver."""
WORDS = {"passed": "right", "failed": "WRONG", "error": "WRONG", "skipped": "not offered"}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options."""
    group = parser.getgroup("feetech-robots", "robots of Feetech servos")
    help_text = "driver of the servo bus to test: my_package.my_module:factory"
    group.addoption("--bus-driver", metavar="FACTORY", help=help_text)
    group.addoption("--bus-robot", metavar="PATH", help="robot behind the fixture bus_target, a TOML file")


def pytest_configure(config: pytest.Config) -> None:
    """Register the mark, and refuse a driver that cannot be loaded."""
    config.addinivalue_line(
        "markers", "robot(path): the robot behind the fixture `bus_target`, a TOML file, relative to the test's"
    )
    if config.option.bus_driver is not None:
        _driver_factory(config.option.bus_driver)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Note which tests are of a driver."""
    if "bus_driver_factory" in getattr(item, "fixturenames", ()):
        item.user_properties.append((_BUS_DRIVER, True))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say what a driver of the servo bus got right, one line a test."""
    name = terminalreporter.config.option.bus_driver
    if name is None:
        return
    terminalreporter.section(f"feetech-robots: bus driver {name}")
    for outcome, word in WORDS.items():
        for report in terminalreporter.stats.get(outcome, []):
            if any(name == _BUS_DRIVER for name, _ in getattr(report, "user_properties", ())):
                test = report.nodeid.rpartition("::")[2].removeprefix("test_").replace("_", " ")
                terminalreporter.line(f"{word:12}{test}")


@pytest.fixture(scope="session")
def bus_driver_factory(request: pytest.FixtureRequest) -> Factory:
    """Makes the driver of `--bus-driver`; see `feetech_robots.bus_driver`."""
    name = request.config.option.bus_driver
    if name is None:
        pytest.skip("tests a driver of the servo bus; run with --bus-driver=my_package.my_module:factory")
    return _driver_factory(name)


@pytest.fixture
def bus_target(request: pytest.FixtureRequest) -> RobotBus:
    """A robot of bus servos on virtual time, one for each test; which one says the mark `robot` or `--bus-robot`."""
    # Projects that do not use the fixture pay for no physics engine.
    from feetech_robots.joint_plant import PhysicsFailedError  # noqa: PLC0415
    from feetech_robots.robot_bus import RobotBus  # noqa: PLC0415

    mark, option = request.node.get_closest_marker("robot"), request.config.option
    if mark is not None:
        path = request.node.path.parent / mark.args[0]
    elif option.bus_robot is not None:
        path = Path(option.bus_robot)
    else:
        pytest.fail("bus_target needs a robot: mark the test with `robot(PATH)`, or run with --bus-robot=PATH")
    try:
        return RobotBus.of_file(path)
    except (ValueError, OSError, PhysicsFailedError) as error:
        pytest.fail(f"bus_target: {error}", pytrace=False)


def _driver_factory(name: str) -> Factory:
    from feetech_robots.bus_driver import driver_factory  # noqa: PLC0415 - as above

    try:
        return driver_factory(name)
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error
