"""What was typed before a question was shown does not answer it, and a job in the background goes on."""

import os
import subprocess
import sys

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hil.dialogue import typed_input
from hil.dialogue.asker import YES_OR_NO, Choice, FreeText, Option
from hil.dialogue.terminal import console
from hil.dialogue.terminal_asker import TerminalAsker

pytestmark = pytest.mark.skipif(os.name != "posix", reason="a terminal of POSIX")
READY = Choice("The hand is about to move.", (Option("done", True), Option("cannot be done", False, "s")))
TYPED = st.lists(st.sampled_from(["", "done", "s", "y", "no idea", "done and mo"]), max_size=5)
IN_BACKGROUND = """
import sys
from hil.cli.exits import run
from hil.dialogue.terminal import console
from hil.dialogue.terminal_asker import TerminalAsker
from hil.dialogue.asker import YES_OR_NO, Choice
run(lambda: TerminalAsker(console()).ask(Choice("Is it warm?", YES_OR_NO)))
"""
SHELL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
job = os.posix_spawn(sys.executable, [sys.executable, "-c", sys.argv[1]], os.environ, setpgroup=0)
_, status = os.waitpid(job, os.WUNTRACED)
print("ended", os.WIFSTOPPED(status))
"""
"""A shell that starts a program in the background of its terminal. Source of its own, because a fork of this process
may hang, with the threads of a library that another test loaded."""


class Prompting(TerminalAsker):
    """Types the next line at each prompt."""

    def __init__(self, terminal, lines=()):
        super().__init__(console())
        self._terminal, self.lines, self.told = terminal, list(lines), []

    def read_line(self, legend):
        os.write(self._terminal, f"{self.lines.pop(0)}\n".encode())
        return super().read_line(legend)

    def tell(self, text):
        self.told.append(text)


@pytest.fixture(scope="module")
def terminal():
    """The person's end of a terminal that is the standard input."""
    person, program = os.openpty()
    with os.fdopen(program) as end, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdin", end)
        patch.setattr(typed_input, "READ_S", 0.0)
        yield person
    os.close(person)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(early=TYPED, answers=st.lists(st.sampled_from(["", "d", "don", "yes"]), max_size=3), moves=st.booleans())
def test_only_a_line_typed_at_the_prompt_answers(terminal, early, answers, moves):
    """One Enter too many once let a hand home and close at the fingers of its owner."""
    os.write(terminal, "\n".join(early).encode())
    asker = Prompting(terminal, [*answers, "done" if moves else "s"])
    assert asker.ask(READY) is moves
    assert not asker.lines
    assert len(asker.told) == len(answers)


def test_a_pasted_line_answers_one_question(terminal):
    asker = Prompting(terminal, ["y\nlooks alike\ndone", "", "s"])
    assert asker.ask(Choice("Is it stiff?", YES_OR_NO)) is True
    assert asker.ask(FreeText("Note:")) == ""
    assert asker.ask(READY) is False


def test_an_end_of_the_input_is_a_stop(terminal):
    asker = Prompting(terminal, ["\x04"])
    with pytest.raises(KeyboardInterrupt):
        asker.ask(READY)


def test_all_lines_of_a_script_count(monkeypatch):
    reading, writing = os.pipe()
    os.write(writing, b"\ndone\nlast words")
    os.close(writing)
    with os.fdopen(reading) as script:
        monkeypatch.setattr("sys.stdin", script)
        asker = TerminalAsker(console())
        assert asker.ask(READY) is True
        assert asker.ask(FreeText("Note:")) == "last words"
        with pytest.raises(KeyboardInterrupt):
            asker.ask(READY)


def test_a_question_in_the_background_stops_nothing():
    """Flushing the terminal of another job stopped the program, and with it the guard of its hand."""
    terminal, program = os.openpty()
    shell = subprocess.Popen(
        [sys.executable, "-c", SHELL, IN_BACKGROUND], stdin=program, stdout=program, stderr=program,
        start_new_session=True,
    )  # fmt: skip
    os.close(program)
    said = b""
    while b"in the background" not in said and b"ended" not in said:
        said += os.read(terminal, 4096)
    shell.kill()
    os.close(terminal)  # the job ends with its terminal
    shell.wait()
    assert b"ended" not in said
