"""The README's owner section, word for word, against a hand that is served as a port, homed and guarded.

Runs in an environment that has the extras that the README names and nothing else but pytest-xdist, in a folder
outside the checkout: `tox -e owner`. What would take too long in CI is shortened by options that are added to a
command. The commands that need a twin of the hand run on a second hand beside the others, since both wait in real time.
"""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from aero import AeroHand
from hil.recordings.mcap_file import read_recording

ROOT = Path(__file__).parents[2]
PORT = "/dev/ttyACM0"
SHORTER = {
    "aero-hil validate": "--only presence --only audit",
    "aero-hil record": "--excite steps --channel index --scale 0.4",
    "aero-hil run-policy": "--seconds 3 --record run.mcap",
}
"""Command to what is added to it here."""
LIMIT_S = 600
FIRST_HAND, SECOND_HAND = pytest.mark.xdist_group("first hand"), pytest.mark.xdist_group("second hand")

pytestmark = pytest.mark.slow


def owner_commands():
    """The commands of the README's owner section, without its installation and without the server."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    block = re.search(r"## Targets.*?```sh\n(.*?)```", text, re.S).group(1)
    lines = [line.partition("#")[0].strip() for line in block.splitlines()]
    commands = [part.strip() for line in lines for part in line.split("&&")]
    return [command for command in commands if command and not command.startswith(("pip ", "aero-hil emulate"))]


def on_two_hands(commands):
    """The commands as parameters; those with `mine`, the recording or the twin, are for the second hand."""
    return [pytest.param(command, marks=SECOND_HAND if "mine" in command else FIRST_HAND) for command in commands]


def as_run(command, port):
    """A command as it is run here: on the served port, shortened, with the suite of the checkout."""
    command = command.replace(PORT, port).replace("tests/hil", str(ROOT / "tests" / "hil"))
    added = next((more for start, more in SHORTER.items() if command.startswith(start)), "")
    return shlex.split(f"{command} {added}")


def scripts():
    """The environment's own programs first, as in an activated environment."""
    return os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


def run(command, folder):
    return subprocess.run(
        command, cwd=folder, env=scripts(), capture_output=True, text=True, timeout=LIMIT_S, check=False
    )


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


@FIRST_HAND
def test_help_and_dry_run(port, folder):
    assert run(["aero-hil", "--help"], folder).returncode == 0
    shown = run(["aero-hil", "validate", "--hil", port, "--dry-run"], folder)
    assert shown.returncode == 0, shown.stderr
    assert "guarded" in shown.stdout


@pytest.mark.parametrize("command", on_two_hands(owner_commands()))
def test_the_owner_section_works_as_it_is_written(port, folder, command):
    """In order: what one command writes, the next reads."""
    ran = run(as_run(command, port), folder)
    assert ran.returncode == 0, f"{command}\n{ran.stdout[-3000:]}\n{ran.stderr[-3000:]}"


@FIRST_HAND
def test_what_was_left_can_be_looked_at_again(port, folder):
    results = folder / "validation" / "latest"
    recordings = sorted(str(path) for path in results.glob("*.mcap"))
    assert read_recording(Path(recordings[0])).header.started
    assert run(["aero-hil", "report", *recordings, "--out", "again.html"], folder).returncode == 0
    assert run(["aero-hil", "diff", str(results / "audit.mcap"), str(results / "audit.mcap")], folder).returncode == 0
    assert run(["aero-hil", "baseline", str(results), "mine"], folder).returncode == 0
    assert run(["aero-hil", "replay", str(results / "session.mcap")], folder).returncode == 0
    assert shutil.which("aero-hil", path=scripts()["PATH"])


@SECOND_HAND
def test_a_terminated_run_keeps_what_it_had_and_opens_the_hand(port, folder):
    command = ["aero-hil", "record", "--hil", port, "--excite", "steps", "--scale", "0.4", "--out", "cut.mcap"]
    with subprocess.Popen(command, cwd=folder, env=scripts(), stderr=subprocess.PIPE, text=True) as child:
        recorded = folder / "cut.mcap"
        while child.poll() is None and (not recorded.exists() or recorded.stat().st_size < 100_000):
            os.sched_yield()
        child.send_signal(signal.SIGTERM)
        said = child.communicate(timeout=60)[1]
    assert child.returncode == 143, said
    assert "were recorded" in said
    found = read_recording(recorded)
    assert not found.header.finished
    assert found.header.duration_s > 1.0
    with AeroHand.open_unguarded(port) as hand:
        assert max(hand.read_codes()) < 0.05 * 65535
