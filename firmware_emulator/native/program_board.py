"""Board that runs a firmware program instead of the emulated firmware: bytes and time in, bytes out."""

from collections.abc import Callable
from pathlib import Path

from firmware_emulator.bus import BusPort, ServoBus
from firmware_emulator.firmware.frames import Opcode, reply
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.firmware.setup_and_loop import ResetCause
from firmware_emulator.kernel import Kernel, milliseconds, on_grid
from firmware_emulator.native.program import (
    FORGET,
    HOST,
    READY,
    RESET,
    SERVOS,
    STORE,
    FirmwareProgramError,
    Program,
    Record,
)

REASONS: dict[ResetCause, int] = {"power_on": 1, "reset": 2, "brown_out": 9}
"""Return values of `esp_reset_reason`: power-on, external pin, brown-out."""
SOFTWARE = 3
"""Return value of `esp_reset_reason` after a restart by the firmware."""
NAMESPACE = "hand/"
"""Namespace prefix of the stored extend values; keys of `Nvs` omit the prefix."""
LONGEST_BOOT_S = 60.0
"""Time-out of a boot with homing, s; the slowest known takes 43 s if no contact is found."""
LONGEST_HOMING_S = 200.0
"""Time-out of a homing requested by the host, s; the slowest known takes 194 s."""
WAIT_STEP_S = 0.01


class ProgramBoard:
    """Firmware program on a board, with its clock and two ports."""

    def __init__(
        self,
        kernel: Kernel,
        bus: ServoBus,
        *,
        program: Path,
        nvs: Nvs,
        transmit: Callable[[bytes], None],
        host_latency_s: float,
    ) -> None:
        """Load a program on a board that is switched off; `transmit` is called with bytes for the host."""
        self.ready = False
        """Whether `setup` has returned."""
        self._kernel = kernel
        self._port: BusPort = bus.connect(self._from_servos)
        self._path = program
        self._nvs = nvs
        self._transmit = transmit
        self._latency_s = host_latency_s
        self._program: Program | None = None
        self._behind_ms = 0
        self._arrived: list[Record] = []
        self._due = False
        self._ticket = 0

    def boot(self, cause: ResetCause) -> None:
        """Start the program now."""
        self._start(REASONS[cause])

    def stop(self) -> None:
        """End the program, as a reset or power-off does."""
        self._ticket += 1
        if self._program is not None:
            self._program.close()
            self._program = None

    def receive(self, data: bytes) -> None:
        """Receive bytes from the host; they reach the firmware after the host latency."""
        self._kernel.call_at(
            on_grid(self._kernel.now + self._latency_s), self._arrive, self._program, (HOST, bytes(data))
        )

    def boot_and_home(self) -> None:
        """Boot after a reset and home as on request, without output to the host.

        Homing cannot be skipped, because its result is in the program's RAM.

        Raises:
            FirmwareProgramError: the program did not boot, or did not acknowledge the homing.
        """
        heard = bytearray()
        transmit, self._transmit = self._transmit, heard.extend
        self.boot("reset")
        self._wait(lambda: self.ready, LONGEST_BOOT_S, "setup() did not return")
        homing = reply(Opcode.HOMING, ())
        self.receive(homing)
        self._wait(lambda: homing in heard, LONGEST_HOMING_S, "HOMING (0x01) is not acknowledged")
        self._transmit = transmit

    def _wait(self, until: Callable[[], bool], longest_s: float, otherwise: str) -> None:
        limit = self._kernel.now + longest_s
        while not until():
            if self._kernel.now >= limit:
                self.stop()
                raise FirmwareProgramError(
                    f"{self._path.name}: {otherwise} within {longest_s:g} s; a hand can also start with its boot, "
                    '`start="power_on"` or `"reset"`'
                )
            self._kernel.run_until(self._kernel.now + WAIT_STEP_S)

    def _start(self, reason: int) -> None:
        self._ticket += 1
        stored = [(name if "/" in name else NAMESPACE + name, value) for name, value in self._nvs.items()]
        self._program = Program(self._path, cause=reason, stored=stored)
        self._behind_ms = milliseconds(self._kernel.now)
        self.ready = False
        self._arrived = []
        self._wake(self._ticket)

    def _from_servos(self, data: bytes) -> None:
        self._arrive(self._program, (SERVOS, data))

    def _arrive(self, program: Program | None, record: Record) -> None:
        if program is not None and program is self._program:
            self._arrived.append(record)
            self._wake(self._ticket)

    def _wake(self, ticket: int) -> None:
        # Scheduled after the other events of this instant, so that one turn handles all of them.
        if ticket == self._ticket and not self._due:
            self._due = True
            self._kernel.call_at(self._kernel.now, self._turn)

    def _turn(self) -> None:
        self._due = False
        if self._program is None:
            return
        arrived, self._arrived = self._arrived, []
        turn = self._program.turn(round(self._kernel.now * 1e9) - self._behind_ms * 1_000_000, arrived)
        for kind, data in turn.records:
            if kind == HOST:
                self._transmit(data)
            elif kind == SERVOS:
                self._port.write(data)
            elif kind == STORE:
                name, value = data.decode().rsplit("=", 1)
                self._nvs.store(name.removeprefix(NAMESPACE), int(value))
            elif kind == FORGET:
                self._nvs.forget(data.decode().removeprefix(NAMESPACE))
            elif kind == READY:
                self.ready = True
            elif kind == RESET:
                self.stop()
                self._start(SOFTWARE)
                return
        self._ticket += 1
        if turn.wake_ms >= 0:
            self._kernel.call_at((turn.wake_ms + self._behind_ms) / 1000.0, self._wake, self._ticket)
