"""The page: the drawn hand, the tables beside it, two plots, and a time line over all frames that were seen."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from io import StringIO
from typing import Literal

import numpy as np
import viser
from viser import uplot

from aero.channels import Channel
from hil.view import panel
from hil.view.access_token import new_token, requiring_token
from hil.view.frame import Heading, Note, Verdicts, ViewFrame
from hil.view.scene import DrawnHand

HOST = "127.0.0.1"
PORT = 8700
"""The first one that is tried; the next free one is taken."""
KEPT = 20_000
"""Frames of a live page that the time line goes back over: eleven minutes."""
DRAWN_HZ, TOLD_HZ = 30.0, 8.0
"""How often the hand is drawn, and how often tables and plots are."""
PLOTTED_S, PLOTTED = 10.0, 300
"""Time and points of a plot."""
SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "5", "20")
ANGLE_COLOURS = ("#8c3cc8", "#333355")
"""Colours of commanded and measured angles."""
CURRENT_COLOURS = ("#2266aa", "#cc3333", "#339933", "#bb6600", "#883388", "#008888", "#555555")
"""Colours of the channels."""
PANEL_PX, PLOT_PX = 500, 180
AXIS_PX = 60
"""Width of an axis that has room for "-100.0"."""

Mode = Literal["live", "playing", "paused"]


class Page:
    """A page that is served from this process until `close`."""

    def __init__(self, heading: Heading, port: int = PORT) -> None:
        """Serve an empty page on the loopback address.

        Raises:
            RuntimeError: the page would not be guarded by its token.
        """
        self._heading = heading
        self._frames: deque[ViewFrame] = deque(maxlen=KEPT if heading.live else None)
        self._notes: list[Note] = []
        self._verdicts: Verdicts | None = None
        self._mode: Mode = "live" if heading.live else "playing"
        self._cursor_s = 0.0
        self._ended = False
        self._drawn: ViewFrame | None = None
        self._shown: tuple[object, ...] = ()
        self._ticked = self._told = time.monotonic()
        token = new_token()
        # viser prints an address without the token.
        with requiring_token(token, heading.title), redirect_stdout(StringIO()):
            self._server = viser.ViserServer(HOST, port, label="Aero Hand", verbose=False)
        self.url = f"http://{HOST}:{self._server.get_port()}/{token}"
        """What to open; whoever knows it can look, nobody can act."""
        self._server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        self._hand = DrawnHand(self._server, heading.side)
        self._build()

    @property
    def viewers(self) -> int:
        """Browsers that look at it now."""
        return len(self._server.get_clients())

    def add(self, frames: Iterable[ViewFrame]) -> None:
        """Add frames, in the order of their time."""
        self._frames.extend(frames)

    def note(self, note: Note) -> None:
        """Add an event."""
        self._notes.append(note)

    def verdicts(self, verdicts: Verdicts) -> None:
        """Replace the findings."""
        self._verdicts = verdicts

    def end(self) -> None:
        """Say that nothing more comes."""
        self._ended = True

    def close(self) -> None:
        """Stop serving."""
        with redirect_stdout(StringIO()):
            self._server.stop()

    def tick(self) -> None:
        """Bring the page up to date; call it `DRAWN_HZ` times a second."""
        now = time.monotonic()
        passed, self._ticked = now - self._ticked, now
        if not self._frames:
            return
        first, last = self._frames[0].t, self._frames[-1].t
        if self._mode == "live":
            self._cursor_s = last
        elif self._mode == "playing" and self.viewers:
            self._cursor_s += passed * float(self._speed.value)
            if self._cursor_s >= last:
                self._mode = "paused"
        self._cursor_s = min(max(self._cursor_s, first), last)
        frame = self._frames[self._index(self._cursor_s)]
        if not self.viewers:
            return
        if frame is not self._drawn:
            self._hand.pose(frame.joints, frame.commanded_joints, frame.loose)
            self._drawn = frame
        if now - self._told >= 1.0 / TOLD_HZ:
            self._told = now
            self._tell(frame)

    def _index(self, t: float) -> int:
        """Return the last frame that is not later than `t`."""
        return max(bisect_right(self._frames, t, key=lambda frame: frame.t) - 1, 0)

    def _build(self) -> None:
        gui = self._server.gui
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_PX)
        self._numbers = gui.add_html("")
        self._time = gui.add_slider("Time, s", 0.0, 1.0, 0.01, 0.0)
        self._buttons = gui.add_button_group("", ("Play", "Pause", *(("Live",) if self._heading.live else ())))
        self._found = gui.add_html("")
        with gui.add_folder("Plots"):
            self._channel = gui.add_dropdown("Channel", [channel.label for channel in Channel])
            self._angles = self._plot("Shaft angle, °", {"commanded": ANGLE_COLOURS[0], "measured": ANGLE_COLOURS[1]})
            self._currents = self._plot("Currents, A", {panel.title(c): CURRENT_COLOURS[c] for c in Channel})
        with gui.add_folder("Settings"):
            self._speed = gui.add_dropdown("Speed of play", SPEEDS, initial_value="1")
            self._ghost = gui.add_checkbox("Commanded posture", True)
        self._time.on_update(self._moved)
        self._buttons.on_click(self._pressed)
        self._ghost.on_update(self._ghost_switched)

    def _plot(self, title: str, lines: dict[str, str]) -> viser.GuiUplotHandle:
        """Add a plot over the hand's time with a line for each name and colour."""
        series = [uplot.Series(label="s"), *(uplot.Series(label=n, stroke=c, width=2) for n, c in lines.items())]
        nothing = tuple(np.zeros((len(series), 1)))
        scales = {"x": uplot.Scale(time=False)}
        axes = (uplot.Axis(), uplot.Axis(size=AXIS_PX))
        return self._server.gui.add_uplot(nothing, tuple(series), scales=scales, axes=axes, title=title, height=PLOT_PX)

    def _tell(self, frame: ViewFrame) -> None:
        """Bring up to date what is read and not watched, where anything is new."""
        first, last = round(self._frames[0].t, 2), round(self._frames[-1].t, 2)
        shown = frame.t, first, last, self._state(), len(self._notes), self._verdicts, self._channel.value
        if shown == self._shown:
            return
        self._shown = shown
        self._numbers.content = panel.numbers(self._heading, frame, self._state())
        self._found.content = panel.found(self._verdicts, [note for note in self._notes if note.t <= frame.t])
        if (self._time.min, self._time.max) != (first, last) and last > first:
            self._time.min, self._time.max = first, last
        if self._mode != "paused":
            # mypy does not see a setter that stands apart from its getter.
            self._time.value = round(frame.t, 2)  # type: ignore[misc]
        self._plot_until(frame)

    def _plot_until(self, frame: ViewFrame) -> None:
        """Draw what led to a frame."""
        end = self._index(frame.t) + 1
        begin = self._index(frame.t - PLOTTED_S)
        step = max((end - begin) // PLOTTED, 1)
        shown = [self._frames[i] for i in range(begin, end, step)]
        times = np.array([one.t for one in shown])
        channel = next(channel for channel in Channel if channel.label == self._channel.value)
        angles = np.rad2deg([[one.commanded[channel], one.measured[channel]] for one in shown]).T
        self._angles.data = (times, *angles)
        self._currents.data = (times, *np.array([one.currents for one in shown]).T)

    def _state(self) -> str:
        if self._mode == "live":
            return "the run has ended" if self._ended else "live"
        return self._mode

    def _moved(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is not None:  # a person, and not the page itself
            self._mode, self._cursor_s = "paused", float(event.target.value)

    def _pressed(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        modes: dict[str, Mode] = {"Play": "playing", "Pause": "paused", "Live": "live"}
        self._mode = modes[event.target.value]
        if self._mode == "playing" and self._frames and self._cursor_s >= self._frames[-1].t:
            self._cursor_s = self._frames[0].t

    def _ghost_switched(self, event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
        self._hand.shows_commanded = event.target.value
        self._drawn = None


def keep_up(page: Page, going_on: Callable[[], bool]) -> None:
    """Keep a page up to date while `going_on()` holds."""
    while going_on():
        began = time.monotonic()
        page.tick()
        time.sleep(max(0.0, 1.0 / DRAWN_HZ - (time.monotonic() - began)))
