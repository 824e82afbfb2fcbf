"""The pytest plugin behind `pytest --hil=TARGET`.

Registered as an entry point, so that it is there wherever this project is installed. It adds the options, one line in
the header, and the fixtures `target` and `hand`; everything heavy is imported when a test first asks for a hand.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from aero import AeroHand
    from hil.target import Target

IN_SOFTWARE = ("emulated", "pty")
"""Targets that need no hardware, and that any number of test processes may open at once."""
REST_S = 1.0
"""Time a hand gets to open between two tests, s."""

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
    group.addoption("--hil-firmware", metavar="VERSION", default="0.2.0", help="firmware of the hand (default 0.2.0)")
    group.addoption("--hil-hand", choices=("right", "left"), default="right", help="side (default right)")
    group.addoption(
        "--hil-unit", metavar="UNIT", default="reference", help="emulated unit: shipped name or .toml (default reference)"
    )
    group.addoption("--hil-seed", type=int, default=0, help="seed of the emulated hand's noise (default 0)")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse a physical hand shared by several test processes."""
    name = config.getoption("--hil")
    if name not in IN_SOFTWARE and getattr(config.option, "numprocesses", None):
        raise pytest.UsageError(f"--hil={name}: one program at a time can use a hand; run without -n")


def pytest_report_header(config: pytest.Config) -> str | None:
    """Say which hand will be tested."""
    option = config.getoption
    unit = f", unit {option('--hil-unit')}, seed {option('--hil-seed')}" if option("--hil") in IN_SOFTWARE else ""
    return f"aero-hil: {option('--hil-hand')} hand on {option('--hil')}, firmware {option('--hil-firmware')}{unit}"


def pytest_collection_finish(session: pytest.Session) -> None:
    """Open a physical hand before the first test, so that a missing one is one error and not one for every test."""
    name = session.config.getoption("--hil")
    wanted = any("target" in getattr(item, "fixturenames", ()) for item in session.items)
    if name in IN_SOFTWARE or not wanted or session.config.getoption("collectonly"):
        return
    from hil.target import NoHandError

    context = _open(session.config)
    try:
        session.config.stash[_TARGET] = context.__enter__()
    except (NoHandError, ValueError) as error:
        raise pytest.UsageError(str(error)) from error
    session.config.add_cleanup(lambda: context.__exit__(None, None, None))


@pytest.fixture(scope="session")
def target(request: pytest.FixtureRequest) -> Iterator[Target]:
    """The hand chosen by `--hil`, opened once for the session; see `hil.Target`."""
    if _TARGET in request.config.stash:
        yield request.config.stash[_TARGET]
        return
    with _open(request.config) as opened:
        yield opened


@pytest.fixture
def hand(target: Target) -> AeroHand:
    """The driver of the target's hand, commanded open and at rest."""
    target.hand.command_codes([0] * 7)
    target.clock.sleep_until(target.clock.now() + REST_S)
    return target.hand


def _open(config: pytest.Config) -> Any:
    from hil.target import open_target

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
