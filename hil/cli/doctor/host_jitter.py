"""How late this machine is: a busy one wakes a sleeping program late, which then looks at the hand late."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aero.clock import Clock
from aero.safety import Thresholds
from aero.safety.lateness import WORTH_SAYING_S
from hil.cli.doctor.finding import Examined, Verdict

TICK_S, TICKS = 0.005, 200
"""A second of ticks, eight in the time between two looks of the guard."""


def lateness_s(clock: Clock) -> NDArray[np.float64]:
    """Return how late each of `TICKS` waits ends, (n,) s; waits for as long as they take."""
    late = np.empty(TICKS)
    for tick in range(TICKS):
        due = clock.now() + TICK_S
        clock.sleep_until(due)
        late[tick] = clock.now() - due
    return late


def check_jitter(late_s: NDArray[np.float64], thresholds: Thresholds | None = None) -> Examined:
    """Judge how late the ticks came, (n,) s, by what the guard of a hand needs."""
    limits = thresholds or Thresholds()
    worst, usual = float(late_s.max()), float(np.quantile(late_s, 0.99))
    found = f"a tick of {1e3 * TICK_S:g} ms came up to {1e3 * worst:.1f} ms late (99 %: {1e3 * usual:.1f} ms)"
    found += f"; the guard of a hand looks every {1e3 * limits.look_s:g} ms"
    data = {"worst_ms": 1e3 * worst, "p99_ms": 1e3 * usual, "ticks": len(late_s), "fine_ms": 1e3 * WORTH_SAYING_S}
    remedy = "end what keeps the machine busy; a fault is noticed later by as much as a look is late"
    if worst <= WORTH_SAYING_S:
        return Examined("jitter", Verdict.OK, found, data=data)
    return Examined("jitter", Verdict.LOOK if worst <= limits.silent_s else Verdict.WRONG, found, remedy, data=data)
