"""What the tests of this folder share. They run on any target and never ask which one it is."""

import numpy as np
import pytest

from aero.policy.interface import PolicyFileError
from aero.policy.shipped import DEFAULT, find_policy
from hil.cli.exits import ending

SETTLE_S, SETTLE_TRIES = 0.4, 8
STILL_RAD_S = 0.1


def pytest_addoption(parser):
    """Let any policy take the part of the shipped one."""
    parser.addoption("--policy", default=DEFAULT, help="What tests/hil/test_policy.py runs: as `aero-hil run-policy`.")


def pytest_configure(config):
    """Refuse a policy that cannot be loaded before a hand is opened."""
    name = config.getoption("--policy", DEFAULT)
    try:
        find_policy(name)
    except (PolicyFileError, ModuleNotFoundError) as error:
        raise pytest.UsageError(f"--policy={name}: {ending(error)[1]}") from error


@pytest.fixture
def target(aero_target):
    """The short name, in the project's own suite."""
    return aero_target


@pytest.fixture
def hand(aero_hand):
    """The short name, in the project's own suite."""
    return aero_hand


@pytest.fixture
def settle(target):
    """Command codes and wait until the hand has come to rest; returns what the encoders then read."""

    def command_and_wait(codes):
        target.hand.command_codes(codes)
        for _ in range(SETTLE_TRIES):
            target.clock.sleep_until(target.clock.now() + SETTLE_S)
            if np.all(np.abs(target.hand.read_speeds()) < STILL_RAD_S):
                return target.hand.read_codes().astype(int)
        pytest.fail(f"the hand still moves {SETTLE_S * SETTLE_TRIES:g} s after a command")

    return command_and_wait


@pytest.fixture
def open_codes():
    """Every channel at its open end."""
    return np.zeros(7, int)
