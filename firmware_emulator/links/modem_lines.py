"""What DTR and RTS do to the board: its USB port is the chip's own, so they are requests on the wire and no pins.

Source: ESP32-S3 technical reference manual, USB Serial/JTAG controller, "reset SoC into download mode"; esptool 5
(`reset.py`) goes through these states. Opening a port raises DTR, then RTS, and closing drops both at once: neither is
a reset. A program that drops DTR while RTS is raised does restart the board.
"""

from __future__ import annotations

from enum import Enum, auto


class Request(Enum):
    """What a state of the two lines asks of the chip."""

    NONE = auto()
    CLEAR_DOWNLOAD = auto()
    """The next reset starts the firmware."""
    SET_DOWNLOAD = auto()
    """The next reset waits for a download."""
    RESET = auto()
    """The chip restarts."""


REQUESTS: dict[tuple[bool, bool], Request] = {
    (False, False): Request.CLEAR_DOWNLOAD,
    (True, False): Request.SET_DOWNLOAD,
    (False, True): Request.RESET,
    (True, True): Request.NONE,
}
"""By (DTR, RTS)."""


class ModemLines:
    """The two lines of one connection."""

    def __init__(self) -> None:
        self._lines = (False, False)
        self.download = False
        """Whether the next reset waits for a download in place of starting the firmware."""

    def set(self, *, dtr: bool | None = None, rts: bool | None = None) -> bool:
        """Change a line; return whether the chip restarts.

        A reset clears nothing: esptool leaves the download mode by a reset from (False, False).
        """
        before = self._lines
        self._lines = (before[0] if dtr is None else dtr, before[1] if rts is None else rts)
        if self._lines == before:
            return False
        request = REQUESTS[self._lines]
        if request in {Request.SET_DOWNLOAD, Request.CLEAR_DOWNLOAD}:
            self.download = request is Request.SET_DOWNLOAD
        return request is Request.RESET
