"""A hand that tests get one after another: what fixtures and tests do to it ends with them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

from aero.errors import AeroError
from hil.faults.bench import BenchState, HandBench
from hil.faults.catalogue import parse_fault
from hil.targets.delays import Waits
from hil.targets.hand_spec import HandSpec
from hil.targets.hands_file import IN_SOFTWARE
from hil.targets.target import GroundTruth, Target

REST_WAIT_S = 0.2
"""Time between two readings of a hand that comes to rest, s."""
REST_TRIES, HANDOVER_TRIES = 15, 75
"""Readings of a hand that opens, and of one after a test: a board may home after what that test did to it."""
REST_RAD_S = 0.2
"""Shaft speed below which a hand is at rest."""
SLEPT_S = 0.05
"""Threshold of waiting in real time, s; above it a test on virtual time shows nothing of its hand."""
NOT_EMULATED = "its faults are for an emulated hand; run with --hil=emulated, or see `aero-hil proxy`"


def chosen(option: Any, faults: Sequence[str] = ()) -> HandSpec:
    """Return the hand that the options of pytest choose, with these faults.

    Raises:
        ValueError: there is none such.
    """
    return HandSpec.named(
        option.aero_hil,
        firmware=option.aero_hil_firmware,
        hand=option.aero_hil_hand,
        unit=option.aero_hil_unit,
        seed=option.aero_hil_seed,
        faults=tuple(map(parse_fault, faults)),
        # As an owner's hand has been; one with faults might not come through it.
        homed=not faults and not option.aero_hil_still,
    )


def left_out(marks: Collection[str], option: Any, target: Target | None, failed: str) -> str:
    """Return why a test is skipped and which option runs it; empty where it is not.

    Args:
        marks: of the test.
        option: those of pytest.
        target: hand of the session; None where it is not opened.
        failed: name of the presence test that failed.
    """
    real_time = target is None or target.real_time
    truth = target is None or target.find(GroundTruth) is not None
    reasons = {
        NOT_EMULATED: "fault" in marks and option.aero_hil not in IN_SOFTWARE,
        f"this hand failed {failed}; mend that first, or choose another hand with --hil": failed,
        "moves the hand; run without --hil-still": "moves" in marks and option.aero_hil_still,
        "drives the hand into its stops; run with --hil-homing": (
            "homes" in marks and real_time and not option.aero_hil_homing
        ),
        "takes long in real time; run with --hil-long": (
            "takes_long" in marks and real_time and not option.aero_hil_long
        ),
        f"{option.aero_hil} has no ground truth; run with --hil=emulated": "needs_ground_truth" in marks and not truth,
    }
    return next((reason for reason, applies in reasons.items() if applies), "")


@dataclass
class SharedHand:
    """The hand of a test session."""

    target: Target
    kept: tuple[str, ...] = ()
    """Acts of fixtures that are still set up."""
    used: bool = False

    def present(self) -> tuple[str, ...]:
        """Return the acts that are not undone."""
        return self.target.get(HandBench).state().acts

    def add(self, acts: Sequence[str]) -> None:
        """Keep what a fixture did."""
        self.kept += tuple(acts)

    def end(self, acts: Sequence[str]) -> None:
        """Undo what a fixture did that ends."""
        self.kept = tuple(one for one in self.kept if one not in acts)
        self.target.get(HandBench).restore([one for one in self.present() if one not in acts])

    def end_test(self) -> None:
        """Undo what a test did."""
        self.target.get(HandBench).restore(self.kept)

    def left_behind(self) -> tuple[str, ...]:
        """Return what an earlier test left, after waiting until the hand is at rest."""
        if self.used:
            at_rest(self.target, HANDOVER_TRIES)
        self.used = True
        return tuple(sorted(set(self.present()) ^ set(self.kept)))


@dataclass(frozen=True)
class LentHand:
    """A hand as one test got it."""

    target: Target
    faults: tuple[str, ...]
    """Texts of the faults that it was opened with for this test."""
    acts: int
    """Number of acts that had been done to it."""
    waits: Waits | None
    now_s: float
    """Its clock, s."""

    @classmethod
    def of(cls, target: Target, faults: tuple[str, ...] = ()) -> LentHand:
        """Note the state of a hand."""
        return cls(target, faults, len(target.get(HandBench).state().done), Waits.now(), target.clock.now())

    def from_now(self) -> LentHand:
        """Return the hand with its waits counted from now."""
        return replace(self, waits=Waits.now(), now_s=self.target.clock.now())

    def slept_s(self) -> float:
        """Return for how long the test waited while the hand's time stood, s; 0 where that is not known."""
        waits = Waits.now()
        if self.target.real_time or waits is None or self.waits is None or waits.disk_reads > self.waits.disk_reads:
            return 0.0
        slept_s = waits.seconds - self.waits.seconds
        return slept_s if slept_s > max(SLEPT_S, self.target.clock.now() - self.now_s) else 0.0

    def done(self) -> list[tuple[str, str]]:
        """Return the property of a JUnit report about acts of the test and its fixtures; none where there were none."""
        done = self.target.get(HandBench).state().done[self.acts :]
        return [("hil_acts", "; ".join(f"{t:.2f} s: {text}" for t, text in done))] if done else []


def at_rest(target: Target, tries: int = REST_TRIES) -> bool:
    """Return whether a hand comes to rest; a board that starts or homes does not answer, which is waited for."""
    for _ in range(tries):
        target.clock.sleep_until(target.clock.now() + REST_WAIT_S)  # first, for a motion begins late
        try:
            if all(abs(target.hand.read_speeds()) < REST_RAD_S):
                return True
        except AeroError:
            pass
    return False


def refusing_acts(target: Target, refuse: Callable[[str], str]) -> Target:
    """Return a target without an emulated hand, of which each act is refused in the caller's way."""
    return replace(target, capabilities=(*target.capabilities, HandBench(refuse, BenchState)))


def properties(target: Target, commit: str) -> list[tuple[str, Any]]:
    """Return the properties of a JUnit report about a hand, and the commit of aero-hil."""
    known = {
        "target": target.name,
        "hand": target.side,
        "firmware": target.firmware,
        "map": target.map.coefficients.name,
        "window": target.map.window.name,
        "unit": target.unit,
        "seed": str(target.seed),
        "commit": commit,
    }
    if target.wrong:
        known["faults"] = " ".join(map(str, target.wrong))
    return [(f"hil_{name}", value) for name, value in known.items()]
