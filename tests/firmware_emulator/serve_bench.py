"""An emulated hand on a bench in its own process: `python serve_bench.py LINK BUS_LINK FIRMWARE START IDS MODEL`.

IDS has one digit a servo; MODEL is the kind of all of them.

Clients busy-poll and have short time-outs, so the hand must not share an interpreter with them.
"""

import signal
import sys
import threading
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from firmware_emulator.hand import EmulatedHand
from firmware_emulator.links.pty import PtyServer
from firmware_emulator.servo.parameters import HLS3606M
from tests.firmware_emulator.conftest import stopped_bench


def main() -> None:
    link, bus_link, firmware, start, ids, model = sys.argv[1:]
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    servos = replace(HLS3606M, model=model)
    hand = EmulatedHand(stopped_bench(), firmware=firmware, start=start, servos=servos)
    hand.bus.servos = hand.servos[: len(ids)]
    for servo, number in zip(hand.bus.servos, ids, strict=True):
        servo.write(5, bytes((int(number),)))
    with PtyServer(hand, link=Path(link), bus_link=Path(bus_link)) as server:
        print("ready", server.name, flush=True)
        server.run(stop.is_set)


main()
