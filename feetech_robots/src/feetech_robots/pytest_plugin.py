"""Pytest plugin: a driver under test (`--bus-driver`) and a robot on virtual time (fixture `bus_target`).

Tests without these fixtures are unaffected, as with `aero_hil_pytest`; packages are imported on first use.
"""

from __future__ import annotations

from collections.abc import Generator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from aero_hil import hidden
from aero_hil_options import PluginOptions

if TYPE_CHECKING:
    from feetech_robots.bus_driver import Factory
    from feetech_robots.robot_bus import RobotBus

_BUS_DRIVER = "feetech_bus_driver"
"""User property that marks tests of a bus driver."""
WORDS = {"passed": "right", "failed": "WRONG", "error": "WRONG", "skipped": "not offered"}
OPTIONS = PluginOptions("feetech-robots", "robots of Feetech servos", taken=pytest.StashKey[list[str]](), options={
    "bus-driver": {
        "metavar": "FACTORY", "help": "driver of the servo bus to test: my_package.my_module:factory",
    },
    "bus-robot": {"metavar": "PATH", "help": "robot behind the fixture bus_target, a TOML file"},
})  # fmt: skip


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    """Add the options."""
    OPTIONS.add(parser, pluginmanager)


@pytest.hookimpl(wrapper=True)
def pytest_load_initial_conftests(
    early_config: pytest.Config, parser: pytest.Parser
) -> Generator[None, object, object]:
    """Add the short option names after those of the project's conftest files, which have priority."""
    result = yield
    OPTIONS.add_short_names(parser, early_config)
    return result


def pytest_configure(config: pytest.Config) -> None:
    """Register the mark and reject a driver that cannot be loaded."""
    config.addinivalue_line(
        "markers", "robot(path): the robot behind the fixture `bus_target`, a TOML file, relative to the test's"
    )
    if config.option.aero_bus_driver is not None:
        _driver_factory(config.option.aero_bus_driver)


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Return a header line if the project hides packages of aero-hil."""
    if line := hidden():
        return [f"feetech-robots is disabled: {line}"]
    return OPTIONS.header(config)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Mark the tests of a bus driver."""
    if "bus_driver_factory" in getattr(item, "fixturenames", ()):
        item.user_properties.append((_BUS_DRIVER, True))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print the result of each test of the bus driver."""
    name = terminalreporter.config.option.aero_bus_driver
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
    """Factory of the driver in `--bus-driver`; see `feetech_robots.bus_driver`."""
    name = request.config.option.aero_bus_driver
    if name is None:
        pytest.skip("tests a driver of the servo bus; run with --bus-driver=my_package.my_module:factory")
    return _driver_factory(name)


@pytest.fixture
def bus_target(request: pytest.FixtureRequest) -> RobotBus:
    """Robot of bus servos on virtual time, new for each test; selected by the mark `robot` or `--bus-robot`."""
    mark, named = request.node.get_closest_marker("robot"), request.config.option.aero_bus_robot
    if mark is not None and mark.args:
        path = request.node.path.parent / str(mark.args[0])
    elif named is not None:
        path = Path(named)
    else:
        said = "bus_target needs a robot: mark the test with `robot(PATH)`, or run with --bus-robot=PATH"
        pytest.fail(said, pytrace=False)
    failed = _ours("feetech_robots.joint_plant").PhysicsFailedError
    try:
        robot: RobotBus = _ours("feetech_robots.robot_bus").RobotBus.of_file(path)
    except (ValueError, OSError, failed) as error:
        pytest.fail(f"bus_target: {error}", pytrace=False)
    return robot


def _driver_factory(name: str) -> Factory:
    try:
        factory: Factory = _ours("feetech_robots.bus_driver").driver_factory(name)
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error
    return factory


def _ours(name: str) -> Any:
    """Import a module on first use; raise a one-line usage error if the project hides our packages."""
    if line := hidden():
        raise pytest.UsageError(line)
    return import_module(name)
