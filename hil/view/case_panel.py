"""Panel of a case on the page: step, question with buttons, and Stop."""

import threading
from collections.abc import Callable
from functools import partial

import viser

from aero.side import Side
from hil.dialogue.asker import READ_S
from hil.view import panel
from hil.view.entered_lines import add_prompt
from hil.view.frame import ANSWER, STOP, Asked, CaseMessage, CaseStands, Moving, Told

LAST_TOLD = 4
"""Number of lines shown, the newest last."""


class CasePanel:
    """Shows the status of a case, and forwards the person's answers."""

    def __init__(self, gui: viser.GuiApi, side: Side, on_words: Callable[[str], object]) -> None:
        """Append the panel to the page; `on_words` receives answers and Stop."""
        self._gui, self._side, self._on_words = gui, side, on_words
        self._told: list[str] = []
        self._stopped = gui.add_html("")
        with gui.add_form(None):
            gui.add_button("Stop: open the hand", color="red").on_click(lambda _event: self._stop())
        self._case = gui.add_html("")
        self._moves = gui.add_html("")
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._lines = gui.add_html("")
        self._question = gui.add_html("")
        self._answers = gui.add_form(None)
        self._buttons: list[viser.GuiButtonHandle] = []
        self._asked = Asked(0)
        self._note = add_prompt(gui, "Note, then Enter", lambda line: self._say(self._asked, line))
        self._note.visible = False

    def show(self, message: CaseMessage) -> None:
        """Show a message."""
        match message:
            case Asked():
                self._ask(message)
            case CaseStands():
                self._case.content = panel.case(message, self._side)
            case Moving():
                if message.text:
                    self._moves.content = panel.moves(message.text)
                self._bar.visible = bool(message.doing) and message.part < 1.0
                # mypy does not see a setter that is defined apart from its getter.
                self._bar.value = 100.0 * min(max(message.part, 0.0), 1.0)  # type: ignore[misc]
                if message.doing:
                    self._moves.content = panel.progress(message)
            case Told():
                self._told.append(message.text)
                self._lines.content = panel.lines(self._told[-LAST_TOLD:])

    def _ask(self, asked: Asked) -> None:
        """Replace the answer inputs by the buttons of a question, enabled after `READ_S`, or a field for a note."""
        self._asked = asked
        for one in self._buttons:
            one.remove()
        self._question.content = panel.question(asked.text)
        self._note.value = ""  # type: ignore[misc]
        self._note.visible = bool(asked.number) and not asked.labels
        with self._answers:
            self._buttons = [self._gui.add_button(label.capitalize(), disabled=True) for label in asked.labels]
        for label, button in zip(asked.labels, self._buttons, strict=True):
            button.on_click(partial(self._say, asked, label))
        # the second click of a double click on the button that was here
        threading.Timer(READ_S, self._enable, [asked]).start()

    def _enable(self, asked: Asked) -> None:
        if asked is self._asked:
            for button in self._buttons:
                button.disabled = False

    def _say(self, asked: Asked, line: str, _event: object = None) -> None:
        """Answer a question; its number lets the receiver ignore a late answer to an earlier question."""
        self._on_words(f"{ANSWER} {asked.number} {line}")

    def _stop(self) -> None:
        self._stopped.content = panel.question("Stopped: the hand opens, and the program ends.")
        self._on_words(STOP)
