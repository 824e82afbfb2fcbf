"""The pytest plugin behind `pytest --hil=TARGET`.

Registered as an entry point, so that it is there wherever this project is installed. It adds the options, one line in
the header, and the fixtures `target` and `hand`; everything heavy is imported when a test first asks for a hand.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, ExitStack
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from aero import AeroHand
    from hil.target import Target

IN_SOFTWARE = ("emulated", "pty")
"""Targets that need no hardware, and that any number of test processes may open at once."""
DEFAULTS = {"--hil-firmware": "0.2.0", "--hil-unit": "reference"}
"""What is known to exist without looking."""
REST_WAIT_S, REST_TRIES = 0.2, 15
"""How often an opening hand is looked at, s, and how many times at most."""
REST_RAD_S = 0.2
"""Shaft speed below which a hand is at rest."""

_TARGET = pytest.StashKey["Target"]()


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
    group.addoption("--hil-seed", type=int, default=0, help="seed of the emulated hand's noise (default 0)")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse options that cannot work, before any test process starts."""
    name = config.getoption("--hil")
    if name not in IN_SOFTWARE and getattr(config.option, "numprocesses", None):
        raise pytest.UsageError(f"--hil={name}: one program at a time can use a hand; run without -n")
    if any(config.getoption(option) != default for option, default in DEFAULTS.items()):
        _opener(config)


def pytest_report_header(config: pytest.Config) -> str | None:
    """Say which hand will be tested."""
    option = config.getoption
    unit = f", unit {option('--hil-unit')}, seed {option('--hil-seed')}" if option("--hil") in IN_SOFTWARE else ""
    return f"aero-hil: {option('--hil-hand')} hand on {option('--hil')}, firmware {option('--hil-firmware')}{unit}"


def pytest_collection_finish(session: pytest.Session) -> None:
    """Open a physical hand before the first test, so that a missing one is one error and not one for every test."""
    config = session.config
    if config.getoption("collectonly") or not any("target" in getattr(i, "fixturenames", ()) for i in session.items):
        return
    from hil.target import NoHandError  # noqa: PLC0415 - loads a physics engine

    opened = ExitStack()
    try:
        config.stash[_TARGET] = opened.enter_context(_opener(config))
    except NoHandError as error:
        raise pytest.UsageError(str(error)) from error
    config.add_cleanup(opened.close)


@pytest.fixture(scope="session")
def target(pytestconfig: pytest.Config) -> Target:
    """The hand chosen by `--hil`, opened once for the session; see `hil.Target`."""
    return pytestconfig.stash[_TARGET]


@pytest.fixture
def hand(target: Target) -> AeroHand:
    """The driver of the target's hand, commanded open and at rest."""
    target.hand.command_codes([0] * 7)
    for _ in range(REST_TRIES):
        target.clock.sleep_until(target.clock.now() + REST_WAIT_S)
        if all(abs(target.hand.read_speeds()) < REST_RAD_S):
            return target.hand
    pytest.fail(f"the hand does not come to rest within {REST_TRIES * REST_WAIT_S:g} s of opening")


def _opener(config: pytest.Config) -> AbstractContextManager[Target]:
    """Return the target's context manager, not yet entered."""
    from hil.target import open_target  # noqa: PLC0415 - loads a physics engine

    option = config.getoption
    try:
        return open_target(
            option("--hil"),
            firmware=option("--hil-firmware"),
            hand=option("--hil-hand"),
            unit=option("--hil-unit"),
            seed=option("--hil-seed"),
        )
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error
