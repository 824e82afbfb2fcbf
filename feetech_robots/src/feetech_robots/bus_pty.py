"""Real-time server of a servo chain: the bus on a pseudo-terminal or on a serial port."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from aero_hil_terminal import Terminal
from firmware_emulator.links import Closing
from firmware_emulator.links.pty import BusEnd, End, put_on_bus, serve
from firmware_emulator.links.serial_port import SerialPort
from firmware_emulator.servo_chain import ServoChain


class BusServer(Closing):
    """Server of a servo chain on a terminal or port; a context manager."""

    def __init__(
        self, chain: ServoChain, *, link: Path | None = None, port: str | None = None, echo: bool = False
    ) -> None:
        """Open the terminal or port; `run` starts serving.

        Args:
            chain: servo chain to serve.
            link: symbolic link to create for the terminal.
            port: serial port (device path or pyserial URL) to use instead of a terminal.
            echo: whether the terminal echoes received bytes, like some half-duplex adapters.

        Raises:
            FileExistsError: `link` exists already.
            serial.SerialException: the port cannot be opened.
        """
        self._chain = chain
        self._echo = echo
        self._takers: dict[End, Callable[[bytes], object]] = {}
        with ExitStack() as opened:
            self._end: BusEnd = Terminal(link) if port is None else SerialPort(port)
            opened.callback(self._end.close)
            self._takers[self._end] = put_on_bus(chain.bus, self._end)
            opened.pop_all()

    @property
    def name(self) -> str:
        """Path of the terminal or port."""
        return self._end.name

    def also(self, end: End, take: Callable[[bytes], object]) -> None:
        """Pass the bytes of an additional end to `take` until the end raises `EOFError`."""
        self._takers[end] = take

    def run(self, stop: Callable[[], bool]) -> None:
        """Serve in real time until `stop()`, polled at least every 50 ms, returns true."""
        serve(self._chain.kernel, self._takers, self._take, stop)

    def close(self) -> None:
        """Close the terminal and remove its link; a second call does nothing."""
        self._end.close()

    def _take(self, end: End) -> None:
        try:
            data = end.read()
        except EOFError:
            # An end at EOF is always ready to read and would make the loop spin.
            del self._takers[end]
        else:
            if self._echo and end is self._end:
                self._end.write(data)
            self._takers[end](data)
