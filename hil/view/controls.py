"""Controls of an emulated hand on the page: a slider a channel, a fault menu, and a text field for any act."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import viser

from aero.channels import Channel
from aero.floats import Floats
from hil.view import panel
from hil.view.entered_lines import add_prompt
from hil.view.frame import FaultOffered

WHOLE_HAND = "whole hand"
OWN_S = 1.0
"""Time after a manual move during which a slider does not follow the hand, s."""


class Controls:
    """Translates the user's acts on the page to commands of the prompt."""

    def __init__(self, gui: viser.GuiApi, faults: Sequence[FaultOffered], on_words: Callable[[str], object]) -> None:
        """Append the controls to the page; `on_words` receives the commands."""
        self._offered = {fault.name: fault for fault in faults}
        self._on_words = on_words
        self._touched = dict.fromkeys(Channel, 0.0)
        with gui.add_folder("Command, % of the window"):
            self._sliders = [gui.add_slider(panel.title(channel), 0.0, 100.0, 1.0, 0.0) for channel in Channel]
        for channel, slider in zip(Channel, self._sliders, strict=True):
            slider.on_update(partial(self._commanded, channel))
        if faults:  # viser refuses a menu without entries
            self._add_faults(gui)
        with gui.add_folder("Do to the hand: type, then Enter; help lists the acts"):
            add_prompt(gui, "Words", self._say)

    def follow(self, percent: Floats) -> None:
        """Set idle sliders to the hand's last command, (7,) % of the window, NaN if unknown."""
        now = time.monotonic()
        for channel, slider in zip(Channel, self._sliders, strict=True):
            told = percent[channel]
            if np.isfinite(told) and now - self._touched[channel] > OWN_S and round(told) != round(slider.value):
                # mypy does not see a setter that is defined apart from its getter.
                slider.value = float(round(told))  # type: ignore[misc]

    def _commanded(self, channel: Channel, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is not None:  # moved by a user, not by the page itself
            self._touched[channel] = time.monotonic()
            self._say(f"command {channel.label} {event.target.value:g}")

    def _add_faults(self, gui: viser.GuiApi) -> None:
        with gui.add_folder("Faults"):
            self._fault = gui.add_dropdown("Fault", list(self._offered))
            self._described = gui.add_html("")
            self._channel = gui.add_dropdown("Channel", [WHOLE_HAND])
            self._severity = gui.add_dropdown("Severity", ["medium"])
            gui.add_button("Inject").on_click(
                lambda _event: self._say(f"inject {self._picked()}={self._severity.value}")
            )
            gui.add_button("Clear").on_click(lambda _event: self._say(f"clear {self._picked()}"))
        self._fault.on_update(lambda _event: self._offer())
        self._offer()

    def _offer(self) -> None:
        """Show the description and the candidate channels of the selected fault."""
        if (fault := self._offered.get(self._fault.value)) is not None:
            self._described.content = panel.described(fault)
            self._channel.options = list(fault.channels) or [WHOLE_HAND]
            self._severity.options = list(fault.steps) or ["medium"]
            self._severity.disabled = not fault.steps

    def _picked(self) -> str:
        where = self._channel.value
        return self._fault.value if where == WHOLE_HAND else f"{self._fault.value}:{where}"

    def _say(self, words: str) -> None:
        self._on_words(words)
