"""A hand that is served as a port, homed and guarded, for each file of tests.

The commands see the extras that the README names and nothing else, in a folder outside the checkout. `tox -e realtime`
runs the files side by side, since they wait in real time.
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
