"""One answer counts: of a terminal and pages that show the same question, whoever is first."""

import os
import signal
import threading
from pathlib import Path

import pytest

from hil.dialogue import typed_input
from hil.dialogue.asker import YES_OR_NO, CaseShown, Choice, FreeText, Motion, Option, StepShown
from hil.dialogue.page_asker import PageAsker
from hil.dialogue.terminal import console
from hil.view.feed import Observer
from hil.view.frame import Asked, CaseStands, Moving, Told

pytestmark = pytest.mark.skipif(os.name != "posix", reason="waits for a terminal and a pipe at once")
QUESTION = Choice("Is it warm?", YES_OR_NO)


class Looking(Observer):
    """A page, as a list of what it was shown."""

    def __init__(self):
        self.shown = []
        self.on_ask = lambda number: None

    sending = True

    def show(self, message):
        self.shown.append(message)


class Prompting(PageAsker):
    """Lets the person act at each prompt."""

    def read_line(self, legend):
        self.page.on_ask(self._number)
        return super().read_line(legend)


@pytest.fixture
def terminal(monkeypatch):
    """The person's end of a terminal that is the standard input."""
    person, program = os.openpty()
    with os.fdopen(program) as end:
        monkeypatch.setattr("sys.stdin", end)
        yield person
    os.close(person)


@pytest.fixture
def asker(terminal, monkeypatch):
    monkeypatch.setattr(typed_input, "READ_S", 0.0)
    made = Prompting(console())
    made.page = Looking()
    return made


@pytest.mark.parametrize(("line", "answer"), [("yes", True), ("no", False)])
def test_a_click_answers(line, answer, asker):
    asker.page.on_ask = lambda number: asker.hear(f"answer {number} {line}")
    assert asker.ask(QUESTION) is answer
    assert asker.page.shown[0] == Asked(1, "Is it warm?", ("yes", "no"))
    assert asker.page.shown[-1] == Asked(0)


def test_a_typed_line_answers(asker, terminal):
    asker.page.on_ask = lambda number: os.write(terminal, b"n\n")
    assert asker.ask(QUESTION) is False


def test_a_note_is_taken_from_either(asker, terminal):
    asker.page.on_ask = lambda number: asker.hear(f"answer {number} 4.9 V at the plug")
    assert asker.ask(FreeText("Note")) == "4.9 V at the plug"
    asker.page.on_ask = lambda number: os.write(terminal, b"\n")
    assert asker.ask(FreeText("Note")) == ""


def test_of_two_pages_that_click_the_first_counts_and_the_second_answers_nothing_later(asker, terminal):
    def both(number):
        asker.hear(f"answer {number} yes")
        asker.hear(f"answer {number} no")

    asker.page.on_ask = both
    assert asker.ask(QUESTION) is True
    asker.page.on_ask = lambda number: os.write(terminal, b"y\n")
    assert asker.ask(QUESTION) is True


def test_a_click_while_an_answer_is_typed_drops_what_was_typed(asker, terminal):
    def click(number):
        os.write(terminal, b"no, it i")
        asker.hear(f"answer {number} yes")

    asker.page.on_ask = click
    assert asker.ask(QUESTION) is True
    asker.page.on_ask = lambda number: os.write(terminal, b"n\n")
    assert asker.ask(QUESTION) is False


@pytest.mark.parametrize("words", ["", "answer", "answer x yes", "answer 99 yes", "dance"])
def test_words_that_answer_nothing_are_asked_again(words, asker, terminal):
    def say(number):
        asker.hear(words)
        os.write(terminal, b"y\n")

    asker.page.on_ask = say
    assert asker.ask(QUESTION) is True


def test_an_answer_that_is_none_is_asked_again(asker):
    def say(number):
        for line in ("perhaps", "", "yes"):
            asker.hear(f"answer {number} {line}")

    asker.page.on_ask = say
    assert asker.ask(QUESTION) is True


def test_stop_is_one_ctrl_c_however_often_it_is_clicked(asker):
    caught = []
    before = signal.signal(signal.SIGINT, lambda *_: caught.append(1))
    try:
        for _ in range(5):
            asker.hear("stop")
    finally:
        signal.signal(signal.SIGINT, before)
    assert caught == [1]


def test_stop_ends_a_question(asker):
    asker.page.on_ask = lambda number: threading.Thread(target=asker.hear, args=("stop",)).start()
    with pytest.raises(KeyboardInterrupt):
        asker.ask(QUESTION)


def test_without_input_the_page_answers_and_without_both_nobody_waits(monkeypatch):
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        asker = Prompting(console())
        asker.page = Looking()
        asker.page.on_ask = lambda number: asker.hear(f"answer {number} yes")
        assert asker.ask(QUESTION) is True
        asker.page.on_ask = lambda number: None
        asker.page.sending = False
        with pytest.raises(KeyboardInterrupt):
            asker.ask(QUESTION)


def test_the_page_shows_what_the_terminal_shows(asker, capsys):
    asker.show(CaseShown(("again: the failure stays",), StepShown("Exchange", "because", 8.0, "a screwdriver", (2, 1))))
    asker.announce(Motion("Fingers will close.", (), 20.0))
    asker.progress(0.5, "audit", 10.0)
    asker.tell("a line")
    asker.close()
    assert asker.page.shown == [
        CaseStands(("again: the failure stays",), "Exchange", "because", 8.0, "a screwdriver", (2, 1)),
        Moving("Fingers will close."),
        Moving("", 0.5, "audit", 10.0),
        Told("a line"),
    ]
    printed = capsys.readouterr().out
    for text in ("again: the failure stays", "Exchange", "a screwdriver", "Fingers will close.", "a line"):
        assert text in printed


def test_an_act_that_is_done_has_one_button(asker):
    asker.page.on_ask = lambda number: asker.hear(f"answer {number} done")
    assert asker.ask(Choice("Ready", (Option("done", True),))) is True
