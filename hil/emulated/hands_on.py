"""User acts on a served hand: commands from prompt and page, executed in the serving thread."""

import math
from collections.abc import Callable, Mapping
from queue import SimpleQueue
from typing import Literal

from aero.channels import WIRE_ORDER, Channel
from aero.protocol import MAX_CODE, make_positions
from firmware_emulator.links.in_process import WireEntry
from hil.emulated.faults.acts import ACTS, act
from hil.emulated.faults.catalogue import CATALOGUE, channel_named, severities
from hil.emulated.faults.fault import STEPS, FaultLayer
from hil.emulated.faults.workbench import Workbench
from hil.targets.typed_lines import TypedLines
from hil.view.frame import FaultOffered

COMMAND = "command"
"""First word of a command that moves a channel like a host: `command ring 40`, in per cent of its window."""
IDLE_S = 2.0
"""Time without bytes from a program, s, after which the page may command the hand."""
ARRIVES_S = 0.1
"""Time until a command of the page is in the servos' registers, s; earlier commands build on the previous one."""

OFFERED = tuple(
    FaultOffered(
        fault.name,
        fault.words,
        severities(fault),
        tuple(channel.label for channel in fault.channels),
        () if fault.severity is None else STEPS,
    )
    for fault in CATALOGUE.values()
    if fault.later and fault.layer is not FaultLayer.HOST
)
"""Faults of the page's menu: those that can begin on a running hand behind a port."""
HELP = "\n".join(
    [
        *(f"{' '.join((name, *one.takes))}: {one.words}" for name, one in ACTS.items()),
        f"{COMMAND} CHANNEL PERCENT: move a channel as a program does",
    ]
)


class HandsOn:
    """Queue of command lines from any thread, executed by `serve`."""

    def __init__(
        self,
        workbench: Workbench,
        tell: Callable[[str, Literal["info", "error"]], None],
        *,
        reads: bool = False,
        answer: Callable[[str], None] | None = None,
        more: Mapping[str, Callable[[str], object]] | None = None,
    ) -> None:
        """Create the queue.

        Args:
            workbench: workbench of the served hand.
            tell: called with a sentence for each executed or refused act.
            reads: True to read lines from standard input; a terminal is read only in the foreground.
            answer: called after each line, with the reason of a refusal or "".
            more: further commands by their first word, called with the rest of the line.
        """
        self._workbench, self._tell, self._answer, self._more = workbench, tell, answer, more or {}
        self._lines: SimpleQueue[str] = SimpleQueue()
        self._codes: list[int] = []
        self._sent_at = self._heard = -math.inf
        self._told = 0
        self._typed = TypedLines(reads)

    def put(self, line: str) -> None:
        """Queue a line, from any thread."""
        self._lines.put(line)

    def heard(self, entry: WireEntry) -> None:
        """Record that a program uses the port."""
        if entry[1] == ">":
            self._heard = entry[0]

    def serve(self) -> None:
        """Execute the queued lines, and report acts that have finished."""
        self._read()
        while not self._lines.empty():
            if line := self._lines.get().strip():
                refused = self._refused(line)
                if self._answer is not None:
                    self._answer(refused)
        for _, text in self._workbench.done[self._told :]:
            self._tell(text, "info")
        self._told = len(self._workbench.done)

    def answered(self, line: str) -> str:
        """Execute a line at once and return one line: `ok` and a sentence, or `error` and the reason."""
        if not line.strip():
            return "error an act is expected, such as inject motor_dead:ring"
        before = len(self._workbench.done)
        if refused := self._refused(line):
            return f"error {refused}"
        return f"ok {'; '.join(text for _, text in self._workbench.done[before:])}".rstrip()

    def _refused(self, line: str) -> str:
        """Execute a line; return the reason of a refusal, or ""."""
        try:
            self._do(line)
        except ValueError as error:
            self._tell(str(error), "error")
            return str(error)
        return ""

    def _do(self, line: str) -> None:
        words = line.split()
        if words[0] in self._more:
            self._more[words[0]](line.partition(" ")[2])
        elif words[0] == "help":
            self._tell(HELP, "info")
        elif words[0] == COMMAND:
            self._command(line)
        else:
            act(self._workbench, line)

    def _command(self, line: str) -> None:
        """Move one channel; the others keep their present goals, whoever commanded them."""
        electronics = self._workbench.electronics
        channel, percent = channel_and_percent(line)
        if electronics.kernel.now - self._heard < IDLE_S:
            raise ValueError("a program commands the hand; the page may when it has been silent for 2 s")
        now = electronics.kernel.now
        if now - self._sent_at > ARRIVES_S:
            words = electronics.commanded_words()
            self._codes = [words[WIRE_ORDER.index(one)] for one in Channel]
        self._codes[channel] = round(percent / 100.0 * MAX_CODE)
        self._sent_at = now
        electronics.receive(make_positions(self._codes))

    def _read(self) -> None:
        """Queue typed lines."""
        try:
            for line in self._typed.taken():
                self.put(line)
        except ValueError as error:
            self._tell(str(error), "error")


def channel_and_percent(line: str) -> tuple[Channel, float]:
    """Return the channel and the percentage, clipped to 0-100 %, of `command CHANNEL PERCENT`.

    Raises:
        ValueError: another format; the message has the valid one.
    """
    _, *words = line.split()
    channel = channel_named(words[0] if words else "")
    try:
        (percent,) = map(float, words[1:])
    except ValueError:
        percent = math.nan
    if math.isnan(percent):
        raise ValueError(f"usage: {COMMAND} CHANNEL PERCENT, not {line!r}")
    return channel, min(max(percent, 0.0), 100.0)
