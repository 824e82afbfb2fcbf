"""The wheel, installed alone and used outside the checkout: what a reader has who installs from a package index."""

import subprocess
from pathlib import Path

import pytest
from extras import activated
from hatchling.builders.wheel import WheelBuilder
from pages import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("wheel")]


@pytest.fixture(scope="module")
def ran(installed, tmp_path_factory):
    """Return the output of a command of the environment that has the wheel alone."""
    folder = tmp_path_factory.mktemp("wheel")
    wheel = Path(next(WheelBuilder(str(ROOT)).build(directory=str(folder / "dist"), versions=["standard"])))
    programs = installed(f"'{wheel}[suite]'")

    def run(program, *words):
        command = [programs / program, *words]
        done = subprocess.run(
            command, cwd=folder, env=activated(programs), capture_output=True, text=True, check=False, timeout=120
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_the_wheel_is_what_is_imported(ran):
    """A checkout on the path would hide files that the wheel lacks."""
    assert "site-packages" in ran("python", "-c", "import hil; print(hil.__file__)")


def test_an_emulated_hand_is_validated(ran):
    ran("aero-hil", "validate", "--only", "presence", "--out", "validation")


def test_pytest_finds_the_fixtures(ran):
    listed = ran("pytest", "--fixtures", "-p", "no:cacheprovider")
    assert all(name in listed for name in ("aero_target", "aero_session_target", "aero_hand", "aero_port"))
