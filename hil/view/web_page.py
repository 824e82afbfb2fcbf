"""Page with the drawn hand, tables, two plots, and a time line over the received frames."""

import time
from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from typing import Literal

import numpy as np
import viser
from viser import uplot

from aero.channels import Channel
from hil.view import panel
from hil.view.access_token import guarding, new_token
from hil.view.case_panel import CasePanel
from hil.view.controls import Controls
from hil.view.frame import Heading, Message, Note, Verdicts, ViewEnd, ViewFrame
from hil.view.scene import DrawnHand

HOST = "127.0.0.1"
PORT = 8700
"""First port to try; the next free one is used."""
KEPT = 20_000
"""Number of frames stored by a live page: eleven minutes of time line."""
DRAWN_HZ, TOLD_HZ = 30.0, 8.0
"""Update rate of the drawn hand, and of tables and plots."""
PLOTTED_S, PLOTTED = 10.0, 300
"""Time span, s, and number of points of a plot."""
ANGLE_COLOURS = {"commanded": "#8c3cc8", "measured": "#333355"}
CHANNEL_COLOURS = ("#2266aa", "#cc3333", "#339933", "#bb6600", "#883388", "#008888", "#555555")
PANEL_PX, PLOT_PX = 500, 180
AXIS_PX = 60
PLOT_PADDING = (12, 10, 0, 0)
"""Room above and right of a plot, px, for half a number of its axis."""
"""Width of an axis with labels up to "-100.0"."""

Mode = Literal["Play", "Pause", "Live"]


class Page:
    """Page served by this process until `close`."""

    def __init__(
        self, heading: Heading, port: int = PORT, *, on_words: Callable[[str], object] = lambda _words: None
    ) -> None:
        """Serve an empty page on the loopback address; `on_words` receives user commands.

        Raises:
            RuntimeError: the server would not check the page's token.
        """
        self._heading, self._on_words = heading, on_words
        self._controls: Controls | None = None
        self._case: CasePanel | None = None
        self._frames: deque[ViewFrame] = deque(maxlen=KEPT if heading.live else None)
        self._notes: list[Note] = []
        self._verdicts: Verdicts | None = None
        self._mode: Mode = "Live" if heading.live else "Play"
        self._begun: float | None = None
        self._cursor_s = 0.0
        self._ended = False
        self._drawn: ViewFrame | None = None
        self._shown: tuple[object, ...] = ()
        self._ticked = self._told = time.monotonic()
        token = new_token()
        # Output is suppressed, because viser prints an address without the token.
        with guarding(token, panel.head(heading)), redirect_stdout(StringIO()):
            self._server = viser.ViserServer(HOST, port, label="Aero Hand", verbose=False)
        self.url = f"http://{HOST}:{self._server.get_port()}/{token}"
        """Address of the page, with the token."""
        self._hand = DrawnHand(self._server, heading.side)
        self._build()

    @property
    def viewers(self) -> int:
        """Number of connected browsers."""
        return len(self._server.get_clients())

    def show(self, message: Message) -> None:
        """Process a message; frames must arrive in order of time."""
        match message:
            case ViewFrame() | Note():
                # A hand on a port has the clock of this machine, which counts from its start.
                self._begun = message.t if self._begun is None else self._begun
                since = replace(message, t=message.t - self._begun) if self._heading.live else message
                self._frames.append(since) if isinstance(since, ViewFrame) else self._notes.append(since)
            case Verdicts():
                self._verdicts = message
            case ViewEnd():
                self._ended = True
            case _ if self._case is not None:
                self._case.show(message)

    def close(self) -> None:
        """Stop serving."""
        with redirect_stdout(StringIO()):
            self._server.stop()

    def tick(self) -> None:
        """Wait for the next update at `DRAWN_HZ`, then update the page."""
        time.sleep(max(0.0, self._ticked + 1.0 / DRAWN_HZ - time.monotonic()))
        now = time.monotonic()
        passed, self._ticked = now - self._ticked, now
        if not self._frames or not self.viewers:
            return
        last = self._frames[-1].t
        if self._mode == "Play":
            self._cursor_s += passed
            if self._cursor_s >= last:
                self._mode = "Pause"
                self._time.value = round(last, 2)  # type: ignore[misc]
        self._cursor_s = last if self._mode == "Live" else min(max(self._cursor_s, self._frames[0].t), last)
        frame = self._frames[self._index(self._cursor_s)]
        if frame is not self._drawn:
            self._hand.pose(frame.joints, frame.commanded_joints, frame.loose)
            self._drawn = frame
        if now - self._told >= 1.0 / TOLD_HZ:
            self._told = now
            self._tell(frame)

    def _index(self, t: float) -> int:
        """Return the index of the last frame at or before `t`, s."""
        return max(bisect_right(self._frames, t, key=lambda frame: frame.t) - 1, 0)

    def _build(self) -> None:
        gui = self._server.gui
        gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_PX)
        if self._heading.asks:
            self._case = CasePanel(gui, self._heading.side, self._on_words)
        self._numbers = gui.add_html("")
        self._time = gui.add_slider("Time, s", 0.0, 1.0, 0.01, 0.0)
        self._buttons = gui.add_button_group("", ("Play", "Pause", *(("Live",) if self._heading.live else ())))
        self._found = gui.add_html("")
        if self._heading.hands_on:
            self._controls = Controls(gui, self._heading.faults, self._on_words)
        with gui.add_folder("Plots"):
            self._channel = gui.add_dropdown("Channel", [channel.label for channel in Channel])
            self._angles = self._plot("Shaft angle, °", ANGLE_COLOURS, self._travel)
            lines = {panel.title(channel): CHANNEL_COLOURS[channel] for channel in Channel}
            self._currents = self._plot("Currents, A", lines, {})
        self._channel.on_update(self._chosen)
        self._time.on_update(self._moved)
        self._buttons.on_click(self._pressed)

    def _plot(self, title: str, lines: dict[str, str], scales: dict[str, uplot.Scale]) -> viser.GuiUplotHandle:
        """Add a plot over hand time; `lines` maps names to colours, `scales` are those of other axes than time."""
        series = [uplot.Series(label="s"), *(uplot.Series(label=n, stroke=c, width=2) for n, c in lines.items())]
        nothing = tuple(np.zeros((len(series), 1)))
        scales = {"x": uplot.Scale(time=False), **scales}
        axes = (uplot.Axis(), uplot.Axis(size=AXIS_PX))
        return self._server.gui.add_uplot(
            nothing, tuple(series), scales=scales, axes=axes, title=title, height=PLOT_PX, padding=PLOT_PADDING
        )

    @property
    def _travel(self) -> dict[str, uplot.Scale]:
        """Scale of the shaft angle: the travel of the chosen channel, because NaN and a hand at rest span none."""
        channel = next(channel for channel in Channel if channel.label == self._channel.value)
        low, high = np.rad2deg(panel.EXCURSION_RAD[channel])
        room = 0.1 * (high - low)
        return {"y": uplot.Scale(range=(float(low - room), float(high + room)))}

    def _tell(self, frame: ViewFrame) -> None:
        """Update tables, controls and plots if any of their inputs changed."""
        first, last = round(self._frames[0].t, 2), round(self._frames[-1].t, 2)
        shown = frame.t, first, last, self._mode, self._ended, len(self._notes), self._verdicts, self._channel.value
        if shown == self._shown:
            return
        self._shown = shown
        live = "the run has ended" if self._ended else "live"
        state = {"Live": live, "Play": "playing", "Pause": "paused"}[self._mode]
        self._numbers.content = panel.numbers(self._heading, frame, state)
        self._found.content = panel.found(self._verdicts, [note for note in self._notes if note.t <= frame.t])
        if self._controls is not None and self._mode == "Live":
            self._controls.follow(frame.window_percent)
        if last > first:
            self._time.min, self._time.max = first, last
        if self._mode != "Pause":
            # mypy does not see a setter that is defined apart from its getter.
            self._time.value = round(frame.t, 2)  # type: ignore[misc]
        begin, end = self._index(frame.t - PLOTTED_S), self._index(frame.t) + 1
        plotted = [self._frames[i] for i in range(begin, end, max((end - begin) // PLOTTED, 1))]
        times = np.array([one.t for one in plotted])
        channel = next(channel for channel in Channel if channel.label == self._channel.value)
        self._angles.data = (times, *np.rad2deg([[one.commanded[channel], one.measured[channel]] for one in plotted]).T)
        self._currents.data = (times, *np.array([one.currents for one in plotted]).T)

    def _chosen(self, _event: object) -> None:
        self._angles.scales = {**(self._angles.scales or {}), **self._travel}

    def _moved(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is not None:  # moved by a user, not by the page itself
            self._mode, self._cursor_s = "Pause", float(event.target.value)

    def _pressed(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        modes: dict[str, Mode] = {"Play": "Play", "Pause": "Pause", "Live": "Live"}
        self._mode = modes[event.target.value]
        if self._mode == "Play" and self._frames and self._cursor_s >= self._frames[-1].t:
            self._cursor_s = self._frames[0].t
