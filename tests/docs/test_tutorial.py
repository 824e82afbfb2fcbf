"""The first hour, word for word: every command in order, and the output that the page shows.

What takes more than a few seconds is marked slow; `tox -e realtime` runs it.
"""

import shlex
import signal
import subprocess
from contextlib import ExitStack, contextmanager

import pytest
from pages import blocks, environment, missing, run, steps

PAGE = "docs/tutorial.md"
INSTALLATION = ("python3 -m venv", ". ~/", "pip install", "mkdir", "cd ")
SERVERS = ("aero-hil emulate", "aero-hil view")
"""They go on until Ctrl-C."""
ENDS_WITH_1 = "--fault"
QUICK = ("aero-hil validate --only presence --only audit", "aero-hil replay", "aero-hil view")
STEPS = [(command, shown) for command, shown in steps(PAGE) if not command.startswith(INSTALLATION)]


@contextmanager
def served(command, shown, folder):
    """A server, from the moment when it has printed what the page shows until Ctrl-C."""
    with subprocess.Popen(
        shlex.split(command), cwd=folder, env=environment(), text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as server:
        said = ""
        while missing(shown, said):
            line = server.stdout.readline()
            assert line, f"{command} ended and printed {said!r}"
            said += line
        try:
            yield
        finally:  # else a failed command would leave it waiting for its server
            server.send_signal(signal.SIGINT)


def follow(chosen, folder):
    """Run commands one after the other; a server runs until the next one starts."""
    (folder / "wave.py").write_text(blocks(PAGE, "python")[0], encoding="utf-8")
    link = str(folder / "hand")
    with ExitStack() as serving:
        for command, shown in chosen:
            as_run = command.replace("/tmp/hand", link)
            expected = [line.replace("/tmp/hand", link) for line in shown]
            if command.startswith(SERVERS):
                serving.close()
                serving.enter_context(served(as_run, expected, folder))
                continue
            script = folder / "wave.py"
            script.write_text(script.read_text(encoding="utf-8").replace("/tmp/hand", link), encoding="utf-8")
            ran = run(as_run, folder)
            assert ran.returncode == (ENDS_WITH_1 in command), f"{command}\n{ran.stdout[-3000:]}"
            assert not missing(expected, ran.stdout), f"{command}\n{ran.stdout[-3000:]}"


def test_nearly_every_command_shows_its_output():
    assert len(STEPS) > 12
    assert sum(not shown for _, shown in STEPS) <= 2


def test_what_is_recorded_replays_alike(tmp_path):
    chosen = [step for step in STEPS if step[0].startswith(QUICK)]
    assert len(chosen) == 4
    follow(chosen, tmp_path)


@pytest.mark.slow
def test_the_first_hour(tmp_path):
    follow(STEPS, tmp_path)


def test_output_that_is_not_printed_is_noticed():
    printed = "within limits; 192 s of hand\ntime in 17.4 s;"
    assert not missing(["within limits; 192 s of hand time in … s;"], printed)
    assert missing(["within limits; 193 s of hand time in … s;"], printed) != []
