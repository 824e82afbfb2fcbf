"""The buttons of a question are enabled once it can be read: a double click does not answer the next question."""

from unittest.mock import MagicMock

import pytest

pytest.importorskip("viser")

from hil.dialogue.asker import READ_S
from hil.view import case_panel
from hil.view.case_panel import CasePanel
from hil.view.frame import Asked


class Gui(MagicMock):
    def add_button(self, label, *, disabled=False, **_):
        return MagicMock(label=label, disabled=disabled)


def test_a_button_is_enabled_after_its_question_was_shown(monkeypatch):
    timers = []
    monkeypatch.setattr(
        case_panel.threading, "Timer", lambda seconds, act, args: timers.append((seconds, act, args)) or MagicMock()
    )
    panel = CasePanel(Gui(), "right", lambda _: None)
    panel.show(Asked(1, "Was there anything to take away?", ("yes", "no")))
    panel.show(Asked(2, "Ready", ("done",)))
    first, second = timers
    first[1](*first[2])
    assert [button.disabled for button in panel._buttons] == [True]
    second[1](*second[2])
    assert [button.disabled for button in panel._buttons] == [False]
    assert {seconds for seconds, *_ in timers} == {READ_S}
