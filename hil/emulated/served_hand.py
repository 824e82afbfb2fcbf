"""Emulated hand on a pseudo-terminal in real time, for `aero-hil emulate` and, as a child process, for `pty`.

The child takes acts on standard input, and prints lines that begin with the words below.
"""

import json
import os
import signal
import sys
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Literal

from aero import AeroHand
from aero.actuation import ActuationMap
from aero.child_process import READY
from aero.safety.interrupts import noted
from firmware_emulator.firmware.nvs import Nvs
from firmware_emulator.links.in_process import InProcessLink
from firmware_emulator.links.pty import PtyServer
from firmware_emulator.native.program import FirmwareProgramError
from hil.emulated.emulated_hand import build_emulated
from hil.emulated.emulated_spec import EmulatedSpec, parsed_faults
from hil.emulated.faults.bench import BenchState
from hil.emulated.hand_source import EmulatedSource
from hil.emulated.hands_on import HandsOn
from hil.emulated.telemetry import MotionSampler
from hil.targets.delays import LATE, LEAST_S
from hil.targets.hand_spec import HOMINGS
from model.units.plausible import unit_named

NEVER_FIRED = "never-fired"
"""First word of the child's line that reports a fault without effect."""
ACTED = "acted"
"""First word of the child's answer to an act; JSON of the bench state and the refusal follows."""
RENEWED = "renewed"
"""Command for a new hand with the faults that follow, and first word of the answer, as the `ready` line."""
OBSERVED = "observed"
"""Argument of the child that samples its hand and serves it on the network too."""
TELEMETRY = "telemetry"
"""Command for the samples of the hand's true state, and first word of the answer, JSON of `MotionSampler.rows`."""


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
        self.unit = unit_named(spec.unit)
        self.electronics, self.workbench = build_emulated(
            self.unit,
            spec,
            start="homed" if bus_port is None else "bare",
            nvs=Nvs(state),
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


def serve(spec: EmulatedSpec, parent: int, *, observed: bool) -> None:
    """Serve a hand, and each new one after it, until SIGTERM, or until the process `parent` has ended.

    An `observed` hand is sampled and also has a network address.
    """
    with noted(signal.SIGINT, signal.SIGTERM) as stopped:

        def ended() -> bool:
            return bool(stopped) or os.getppid() != parent

        word, following = READY, [spec]
        while following:
            following = _served(following[0], word, ended, observed=observed)
            word = RENEWED


def _served(spec: EmulatedSpec, word: str, ended: Callable[[], bool], *, observed: bool) -> list[EmulatedSpec]:
    """Serve one hand; return the specification of the next, or nothing at the end."""
    following: list[EmulatedSpec] = []
    served = ServedHand(spec, listen=("127.0.0.1", 0) if observed else None)
    codec = ActuationMap.for_firmware(spec.firmware, side=spec.side)
    sampler = MotionSampler(EmulatedSource(served.electronics, served.workbench.mechanics, codec)) if observed else None

    def answer(refused: str) -> None:
        _say(ACTED, json.dumps(asdict(BenchState.of(served.workbench)) | {"refused": refused}))

    def late(by_s: float) -> None:
        if by_s >= LEAST_S:
            _say(LATE, f"{by_s:.4f}")

    def renew(faults: str) -> None:
        following.append(replace(spec, faults=parsed_faults(faults.split())))

    def telemetry(_rest: str) -> None:
        _say(TELEMETRY, json.dumps(sampler.rows() if sampler is not None else []))

    hands_on = HandsOn(served.workbench, _tell, reads=True, answer=answer, more={RENEWED: renew, TELEMETRY: telemetry})
    served.server.listeners.append(hands_on.heard)
    served.server.on_late = late

    def stop() -> bool:
        hands_on.serve()
        if sampler is not None:
            sampler.sample(served.electronics.kernel.now)
        return bool(following) or ended()

    with served.server as server, closing(served.electronics):
        _say(word, f"{server.name} {server.url or ''}".rstrip())
        server.run(stop)
    for fault in served.workbench.schedule.unfired():
        _say(NEVER_FIRED, str(fault))
    return following


def _say(word: str, rest: str) -> None:
    with suppress(OSError):  # the parent has ended, which `stop` notices
        print(word, rest, flush=True)


def _tell(text: str, _severity: Literal["info", "error"]) -> None:
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    try:
        serve(spec_of(sys.argv[1]), int(sys.argv[2]), observed=sys.argv[3] == OBSERVED)
    except (ValueError, FirmwareProgramError) as error:
        sys.exit(f"Error: {error}")
