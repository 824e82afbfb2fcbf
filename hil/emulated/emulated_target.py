"""Target with an emulated hand behind it: faults, acts, and the true state of the hand."""

from dataclasses import dataclass

from firmware_emulator.hand import EmulatedHand
from hil.emulated.faults.bench import HandBench
from hil.emulated.faults.fault import Injection
from hil.emulated.hand_source import EmulatedSource
from hil.targets.hand_errors import MissingCapabilityError
from hil.targets.target import Target
from hil.view.sources import Source, source_of
from model import BuiltHandPlant


@dataclass(frozen=True)
class GroundTruth:
    """True state of an emulated hand in this process, independent of its readings."""

    plant: BuiltHandPlant
    """Mechanics: joint angles, cable tensions, slack."""
    electronics: EmulatedHand
    """Electronics: board, bus and servos."""


@dataclass(frozen=True, repr=False, kw_only=True)
class EmulatedTarget(Target):
    """Emulated hand, ready for commands, with faults and acts on it."""

    bench: HandBench
    """Performs acts on the hand, in this process or another."""
    in_process: GroundTruth | None = None
    """True state of a hand in this process; None on a pseudo-terminal."""

    @property
    def truth(self) -> GroundTruth:
        """True state of the hand.

        Raises:
            MissingCapabilityError: the hand is in another process.
        """
        if self.in_process is None:
            raise MissingCapabilityError(f"{self.port} has no ground truth; run with --hil=emulated for it")
        return self.in_process

    @property
    def wrong(self) -> tuple[Injection, ...]:
        """Present faults."""
        return self.bench.present()

    def inject(self, fault: Injection | str) -> None:
        """Inject a fault now, as in `target.inject("motor_dead:ring")`.

        Raises:
            ValueError: unknown fault, or a fault that this hand refuses.
        """
        self.bench.inject(fault)

    def clear(self, fault: Injection | str) -> None:
        """Clear a fault.

        Raises:
            ValueError: the hand does not have the fault, or the fault cannot be undone.
        """
        self.bench.clear(fault)

    def act(self, words: str) -> str:
        """Perform an act of `hil.emulated.faults.acts.ACTS`, as in `target.act("exchange_servos ring pinky")`.

        Returns a sentence about the act.

        Raises:
            ValueError: unknown act, or an act that this hand refuses.
        """
        return self.bench.act(words)


@source_of.register
def true_source(target: EmulatedTarget) -> Source:
    """Return the true state of a hand in this process, else the link."""
    if (truth := target.in_process) is None:
        link: Source = source_of.dispatch(Target)(target)
        return link
    return EmulatedSource(truth.electronics, truth.plant, target.map)
