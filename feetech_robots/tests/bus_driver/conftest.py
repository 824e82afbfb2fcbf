"""What the tests of this folder share: a driver, and the emulated bus that it is on."""

from pathlib import Path

import pytest
from feetech_robots.bus_driver import served_bus

HERE = Path(__file__).parent
TRIES = 10
WHEELS = dict.fromkeys((1, 2, 3), "STS3215")


class ReportedFailure:
    """Failure that a driver reported in place of a value."""

    def __init__(self, error):
        self.error = error

    def __repr__(self):
        return f"reported: {self.error!r}"


def attempted(call, *arguments):
    """Return what a call returns, or the failure that it reported."""
    try:
        return call(*arguments)
    except NotImplementedError:
        pytest.skip("not offered")
    except Exception as error:
        return ReportedFailure(error)


def asked(call, *arguments):
    """Return what a call returns, asked again while it tells of a failure.

    For what must come in the end: on a loaded machine a right answer may come after a driver's time-out.
    """
    for _ in range(TRIES):
        found = attempted(call, *arguments)
        if not isinstance(found, ReportedFailure):
            break
    return found


@pytest.fixture
def make_bus(bus_driver_factory):
    """Serve one of the robots of this folder and put the driver on it."""
    opened = []

    def make(robot, servos):
        context = served_bus(HERE / robot)
        served = context.__enter__()
        opened.append((context, None))
        driver = bus_driver_factory(served.port, servos)
        opened[-1] = context, driver
        return driver, served

    yield make
    for context, driver in opened:
        if driver is not None:
            driver.close()
        context.__exit__(None, None, None)


@pytest.fixture
def bus(make_bus):
    """The driver on three STS3215 that turn freely, IDs 1, 2 and 3, and the bus."""
    return make_bus("wheels.toml", WHEELS)
