"""A hand that is served as a port, homed and guarded, for each file of tests.

The tests run in an environment that has the extras that the README names and nothing else but pytest-xdist, in a folder
outside the checkout: `tox -e owner`. The two files run side by side, since both wait in real time.
"""

import signal
import subprocess

import pytest
from owner_section import scripts

from aero import AeroHand


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("owner")


@pytest.fixture(scope="module")
def port(folder):
    """A hand of another seed, homed as every physical hand has been."""
    command = ["aero-hil", "emulate", "--link", "hand", "--seed", "5"]
    with subprocess.Popen(command, cwd=folder, env=scripts(), stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout.readline().startswith("ready")
        link = str(folder / "hand")
        with AeroHand.open_unguarded(link) as hand:
            hand.home()
        yield link
        server.send_signal(signal.SIGTERM)
