"""Target of a test or an experiment: one hand behind one interface.

An experiment never depends on the kind of target. `hil.emulated.emulated_target.EmulatedTarget` adds what only an
emulated hand has: faults, acts and its true state.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from aero.actuation import ActuationMap
from aero.channels import Channel
from aero.clock import Clock, WallClock
from aero.firmware import firmware_of
from aero.hand import Hand
from aero.safety import GuardedHand, WatchedClock
from aero.side import Side
from hil.dialogue.asker import Choice
from hil.targets.delays import DelayLog
from hil.targets.hand_errors import MissingCapabilityError
from hil.targets.hand_spec import PHYSICAL, hand_words
from hil.targets.wire_log import WireLog

EMULATED_ONLY = ("inject", "clear", "act", "truth", "bench")
"""Attributes of an emulated hand."""
FORMER = {"get": "truth", "find": "truth"}
"""Former attributes: the present one."""


@dataclass(frozen=True, repr=False)
class Target:
    """Open hand, ready for commands, with its description and logs."""

    port: str
    """Path or URL of the port; `emulated` or `pty` for an emulated hand."""
    hand: Hand
    clock: Clock
    map: ActuationMap
    firmware: str
    side: Side
    hand_id: str
    """Name or serial number of the individual hand; empty if unknown."""
    wire: WireLog
    """Log of the bytes since the target was opened."""
    delays: DelayLog
    """Scheduling delays of this program and an emulated board since the opening; empty on virtual time."""
    unit: str = PHYSICAL
    """Unit file of an emulated hand, `physical` for a hand on a port."""
    seed: int = 0
    serial_number: str = ""
    """Serial number of the hand's USB port; empty if unknown."""
    onlooker: Callable[[Choice[str]], str] | None = None
    """Person who looks at the hand and answers; raises `KeyboardInterrupt` once the dialogue has ended."""
    program_errors: tuple[type[Exception], ...] = ()
    """Errors of a firmware program on an emulated board, which end an experiment."""

    if not TYPE_CHECKING:

        def __getattr__(self, name):
            """Explain what this hand lacks."""
            if name in FORMER:
                raise AttributeError(f"there is no `{name}` any more; an emulated hand has `target.{FORMER[name]}`")
            if name in EMULATED_ONLY:
                raise MissingCapabilityError(f"{self.port} has no `{name}`; run with --hil=emulated for it")
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def __repr__(self) -> str:
        """Return one line, because pytest prints it for a failed test."""
        return f"<Target: {self.describe()}>"

    @property
    def name(self) -> str:
        """Name of the individual hand; its port if it has no name."""
        return self.hand_id or self.port

    @property
    def real_time(self) -> bool:
        """True if hand time is real time."""
        return isinstance(self.clock.bare if isinstance(self.clock, WatchedClock) else self.clock, WallClock)

    @property
    def guard(self) -> GuardedHand | None:
        """Guarded hand, or None for an unguarded hand."""
        return self.hand if isinstance(self.hand, GuardedHand) else None

    @property
    def may_push_at_stops(self) -> bool:
        """True if the thumb may push at its end stops: unguarded, or with a firmware whose torque can be reduced."""
        return self.guard is None or firmware_of(self.firmware).settings is not None

    def begin(self, *, stops: Iterable[Channel] = ()) -> None:
        """Check and open a guarded hand before an experiment starts its clock; do nothing for an unguarded hand.

        Args:
            stops: channels that the experiment drives into their end stops, with reduced torque.

        Raises:
            SafetyStopError: the guard refuses to move the hand, or the hand did not open.
        """
        if self.guard is not None:
            self.guard.expect_stops(stops)

    @property
    def wrong(self) -> tuple[object, ...]:
        """Present faults of an emulated hand; `str` returns the text that `parse_fault` reads."""
        return ()

    def describe(self) -> str:
        """Return a description of the hand in one line."""
        wrong = ", ".join(map(str, self.wrong))
        return hand_words(
            self.side, self.port, self.firmware, unit=self.unit, seed=self.seed, hand_id=self.hand_id, wrong=wrong
        )
