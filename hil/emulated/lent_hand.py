"""Hand shared by the tests of a session: acts of fixtures and tests are undone at their end."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any

from aero.errors import AeroError
from hil.emulated.emulated_spec import named_spec
from hil.emulated.emulated_target import EmulatedTarget
from hil.emulated.faults.bench import BenchState, HandBench
from hil.targets.delays import Waits
from hil.targets.hand_spec import PortSpec
from hil.targets.hands_file import EMULATED_TARGETS
from hil.targets.target import Target

REST_WAIT_S = 0.2
"""Time between two readings of a settling hand, s."""
REST_TRIES, HANDOVER_TRIES = 15, 75
"""Readings of a hand that opens, and of a hand after a test, whose board may still home."""
REST_RAD_S = 0.2
"""Threshold of shaft speed, rad/s; below it on all channels the hand is at rest."""
SLEPT_S = 0.05
"""Threshold of waiting in real time, s; above it a test on virtual time shows nothing of its hand."""
DISK_READ_S = 0.00125
"""Longest wait for a block of 512 bytes from a disk, s: a page of 4 KiB takes a hard disk 10 ms."""
NOT_EMULATED = "its faults are for an emulated hand; run with --hil=emulated, or see `aero-hil proxy`"


def chosen(option: Any, faults: Sequence[str] = ()) -> PortSpec:
    """Return the hand specified by the options of pytest, with these faults.

    Raises:
        ValueError: invalid options or faults.
    """
    return named_spec(
        option.aero_hil,
        firmware=option.aero_hil_firmware,
        side=option.aero_hil_side,
        unit=option.aero_hil_unit,
        seed=option.aero_hil_seed,
        faults=faults,
        # Homed like an owner's hand; not with faults, because homing may fail on a faulty hand.
        homed=not faults and not option.aero_hil_still,
    )


def left_out(marks: Collection[str], option: Any, target: Target | None, failed: str) -> str:
    """Return the reason to skip a test and the option that runs it; empty for a test to be run.

    Args:
        marks: marks of the test.
        option: options of pytest.
        target: hand of the session; None before its opening.
        failed: name of the failed presence test; empty if none failed.
    """
    real_time = target is None or target.real_time
    truth = target is None or (isinstance(target, EmulatedTarget) and target.in_process is not None)
    reasons = {
        NOT_EMULATED: "fault" in marks and option.aero_hil not in EMULATED_TARGETS,
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


class RefusingBench(HandBench):
    """Bench of a physical hand, which passes each act to a function that refuses."""

    def __init__(self, refuse: Callable[[str], str]) -> None:
        self._refuse = refuse

    def act(self, words: str) -> str:
        """Refuse an act."""
        return self._refuse(words)

    def state(self) -> BenchState:
        """Return the state of a hand without acts."""
        return BenchState()


@dataclass
class SharedHand:
    """The hand of a test session."""

    target: EmulatedTarget
    close: Callable[[], object] = lambda: None
    kept: tuple[str, ...] = ()
    used: bool = False
    _restored: bool = True
    """False while the acts of a test are undone, which its time-out may interrupt."""

    @property
    def lost(self) -> bool:
        """True for an emulated hand that an exception has left in the middle of an event; it never answers again."""
        truth = self.target.in_process
        return truth is not None and truth.electronics.kernel.left

    def present(self) -> tuple[str, ...]:
        """Return the acts that describe the hand's present state."""
        return self.target.bench.state().acts

    def add(self, acts: Sequence[str]) -> None:
        """Store the acts of a fixture."""
        self.kept += tuple(acts)

    def end(self, acts: Sequence[str]) -> None:
        """Undo the acts of an ending fixture."""
        self.kept = tuple(one for one in self.kept if one not in acts)
        self.target.bench.restore([one for one in self.present() if one not in acts])

    def end_test(self) -> None:
        """Undo the acts of a test; keep those of active fixtures."""
        self._restored = False
        self.target.bench.restore(self.kept)
        self._restored = True

    def left_behind(self) -> tuple[str, ...]:
        """Wait until the hand is at rest, and return the acts that an earlier test did not undo."""
        if not self._restored:
            self.end_test()
        if self.used:
            at_rest(self.target, HANDOVER_TRIES)
        self.used = True
        return tuple(sorted(set(self.present()) ^ set(self.kept)))


@dataclass(frozen=True)
class LentHand:
    """State of a hand at the start of one test."""

    target: EmulatedTarget
    faults: tuple[str, ...]
    """Texts of the faults that the hand was opened with for this test."""
    acts: int
    """Number of previous acts on the hand."""
    waits: Waits | None
    now_s: float
    mark: int
    """Position in the wire log."""

    @classmethod
    def of(cls, target: EmulatedTarget, faults: tuple[str, ...] = ()) -> LentHand:
        """Return the present state of a hand."""
        now_s, mark = target.clock.now(), target.wire.mark()
        return cls(target, faults, len(target.bench.state().done), Waits.now(), now_s, mark)

    def from_now(self) -> LentHand:
        """Return the hand with its waits counted from now."""
        return replace(self, waits=Waits.now(), now_s=self.target.clock.now(), mark=self.target.wire.mark())

    def slept_s(self) -> float:
        """Return the real time, s, that the test slept instead of the hand; 0 if unknown or below `SLEPT_S`.

        A test that waits by the hand's clock as well may sleep, for example in another program.
        """
        waits = Waits.now()
        if self.target.real_time or waits is None or self.waits is None or self._waited_s() > SLEPT_S:
            return 0.0
        slept_s = waits.seconds - self.waits.seconds - DISK_READ_S * (waits.disk_reads - self.waits.disk_reads)
        return slept_s if slept_s > SLEPT_S else 0.0

    def _waited_s(self) -> float:
        """Return the hand time, s, that the test waited: before its bytes to the hand, and for late answers."""
        waited_s, last = 0.0, self.now_s
        for t, direction, _ in self.target.wire.since(self.mark, 0.0):
            if direction == "to_hand" or t - last > SLEPT_S:
                waited_s += t - last
            last = t
        return waited_s + self.target.clock.now() - last

    def done(self) -> list[tuple[str, str]]:
        """Return the JUnit property with the acts of the test and its fixtures; empty without acts."""
        done = self.target.bench.state().done[self.acts :]
        return [("hil_acts", "; ".join(f"{t:.2f} s: {text}" for t, text in done))] if done else []


def shared(target: Target, refuse: Callable[[str], str], close: Callable[[], object]) -> SharedHand:
    """Return the hand of a session; a physical one passes each act to `refuse`."""
    if isinstance(target, EmulatedTarget):
        return SharedHand(target, close)
    return SharedHand(EmulatedTarget(**vars(target), bench=RefusingBench(refuse)), close)


def at_rest(target: Target, tries: int = REST_TRIES) -> bool:
    """Return True once a hand is at rest, or False after `tries` polls; a restarting or homing board does not reply."""
    for _ in range(tries):
        target.clock.sleep_until(target.clock.now() + REST_WAIT_S)  # first, because a motion starts with a delay
        try:
            if all(abs(target.hand.read_speeds()) < REST_RAD_S):
                return True
        except AeroError:
            pass
    return False


def properties(target: Target, commit: str) -> list[tuple[str, Any]]:
    """Return the JUnit properties that describe a hand and the commit of aero-hil."""
    known = {
        "target": target.port,
        "side": target.side,
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
