"""Emulated hand on a pseudo-terminal in real time, for `aero-hil emulate` and, as a child process, for `pty`.

The child takes acts on standard input, and prints lines that begin with the words below.
"""

import json
import os
import signal
import sys
from contextlib import closing, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

from aero import AeroHand
from aero.child_process import READY
from aero.safety.interrupts import noted
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.links.pty import PtyServer
from firmware_emulator.native.program import FirmwareProgramError
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from hil.emulated.faults import Schedule
from hil.emulated.faults.bench import BenchState
from hil.emulated.hands_on import HandsOn
from hil.targets.delays import LATE, LEAST_S
from hil.targets.hand_spec import HOMINGS
from model.units.plausible import unit_named

NEVER_FIRED = "never-fired"
"""First word of the child's line that reports a fault without effect."""
ACTED = "acted"
"""First word of the child's answer to an act; JSON of the bench state and the refusal follows."""


class ServedHand:
    """Emulated hand with its workbench and the server of its ports."""

    def __init__(
        self, spec: EmulatedSpec, *, state: Path | None = None, bus_port: str | None = None, **ports: Any
    ) -> None:
        """Build the hand and open its ports.

        Args:
            spec: the hand, on port `pty`.
            state: file of the board's stored calibration; None for none.
            bus_port: serial port of a physical board, which then replaces the emulated one.
            ports: further arguments of `PtyServer`.

        Raises:
            ValueError: an unknown unit, faults that do not fit the hand, or a port in use.
            FirmwareProgramError: the program does not run, or does not home.
        """
        self.schedule = Schedule(spec.faults, spec.seed)
        """Faults, with their firing state."""
        self.unit = unit_named(spec.unit)
        self.electronics, self.workbench = build_emulated(
            self.unit,
            spec,
            start="homed" if bus_port is None else "bare",
            nvs=Nvs(state),
            schedule=self.schedule,
        )
        self.workbench.at_a_port = True
        self.electronics.says_rom_text = True
        for _ in range(HOMINGS if spec.homed else 0):  # on virtual time, ten times faster than a client's homing
            AeroHand(InProcessLink(self.electronics), self.electronics.clock).home()
        self.server = PtyServer(self.electronics, bus_port=bus_port, **ports)


def spec_text(spec: EmulatedSpec) -> str:
    """Return the specification of a hand as JSON text, the argument of the child process."""
    fields = {name: getattr(spec, name) for name in ("firmware", "side", "unit", "seed", "homed")}
    program = None if spec.firmware_program is None else str(spec.firmware_program)
    return json.dumps(fields | {"firmware_program": program, "faults": [*map(str, spec.faults)]})


def spec_of(text: str) -> EmulatedSpec:
    """Parse the text of `spec_text`."""
    return EmulatedSpec("pty", **json.loads(text))


def serve(spec: EmulatedSpec, parent: int) -> None:
    """Serve a hand until SIGTERM, or until the process `parent` has ended."""
    with noted(signal.SIGINT, signal.SIGTERM) as stopped:
        served = ServedHand(spec)

        def answer(refused: str) -> None:
            _say(ACTED, json.dumps(asdict(BenchState.of(served.workbench)) | {"refused": refused}))

        def late(by_s: float) -> None:
            if by_s >= LEAST_S:
                _say(LATE, f"{by_s:.4f}")

        hands_on = HandsOn(served.workbench, _tell, reads=True, answer=answer)
        served.server.listeners.append(hands_on.heard)
        served.server.on_late = late

        def stop() -> bool:
            hands_on.serve()
            return bool(stopped) or os.getppid() != parent

        with served.server as server, closing(served.electronics):
            _say(READY, server.name)
            server.run(stop)
    for fault in served.schedule.unfired():
        _say(NEVER_FIRED, str(fault))


def _say(word: str, rest: str) -> None:
    with suppress(OSError):  # the parent has ended, which `stop` notices
        print(word, rest, flush=True)


def _tell(text: str, _severity: Literal["info", "error"]) -> None:
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    try:
        serve(spec_of(sys.argv[1]), int(sys.argv[2]))
    except (ValueError, FirmwareProgramError) as error:
        sys.exit(f"Error: {error}")
