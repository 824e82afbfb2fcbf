"""How this machine draws, and how late it wakes a program."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from aero.clock import Clock
from aero.safety import Thresholds
from aero.safety.lateness import WORTH_SAYING_S
from hil.robots.finding import Examined, Verdict

PATIENCE_S = 30.0
"""For one attempt, s; a good one takes about one."""
BACKENDS = {"linux": ("egl", "osmesa")}
"""What to try where the first attempt fails, by `sys.platform`: what needs no display."""
LOADED, DREW = "loaded", "drew"
# Left at once in the end: some OpenGL fail on being put away.
PROGRAM = f"""
import os, mujoco
print("{LOADED}", flush=True)
renderer = mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16)
renderer.render()
print("{DREW}", flush=True)
os._exit(0)
"""


@dataclass(frozen=True)
class Attempt:
    """What came of trying to draw."""

    loaded: bool
    """Whether MuJoCo could be loaded."""
    drew: bool
    said: str = ""
    """The last thing that was said about a failure."""


def attempt(backend: str | None, patience_s: float = PATIENCE_S) -> Attempt:
    """Load MuJoCo and draw, with `MUJOCO_GL` set to `backend` or, for None, not set."""
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    if backend is not None:
        environment["MUJOCO_GL"] = backend
    command = [sys.executable, "-P", "-c", PROGRAM]
    try:
        ran = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=patience_s, check=False)
    except subprocess.TimeoutExpired as error:
        out = error.stdout.decode() if isinstance(error.stdout, bytes) else error.stdout or ""
        return Attempt(LOADED in out, drew=False, said=f"it did not end within {patience_s:g} s")
    said = [line for line in ran.stderr.splitlines() if line.strip()] or [f"it ended with status {ran.returncode}"]
    return Attempt(LOADED in ran.stdout, DREW in ran.stdout, said[-1])


def check_drawing(tried: Callable[[str | None], Attempt] = attempt, *, present: bool | None = None) -> Examined:
    """Look whether MuJoCo draws.

    Args:
        tried: how to try.
        present: whether MuJoCo is installed; looked up when None.
    """
    if not (find_spec("mujoco") is not None if present is None else present):
        return Examined("drawing", Verdict.OK, "MuJoCo is not installed (extra `emulate`), so nothing draws")
    named = os.environ.get("MUJOCO_GL")
    setting = "MUJOCO_GL is not set" if named is None else f"MUJOCO_GL={named}"
    first = tried(named)
    data = {"MUJOCO_GL": named, "loaded": first.loaded, "drew": first.drew}
    if first.drew:
        return Examined("drawing", Verdict.OK, f"MuJoCo draws; {setting}", data=data)
    others: list[str | None] = [None] if named is not None and not first.loaded else []
    others += [backend for backend in BACKENDS.get(sys.platform, ()) if backend != named]
    works = next((backend for backend in others if tried(backend).drew), named)
    if works is not None and works != named:
        remedy = f"export MUJOCO_GL={works}, which works here"
    else:
        remedy = (
            "install an OpenGL that needs no display (Debian: libegl1 or libosmesa6) and set MUJOCO_GL=egl or osmesa"
        )
    if not first.loaded:
        return Examined(
            "drawing", Verdict.WRONG, f"MuJoCo cannot be loaded; {setting}: {first.said}", remedy, data=data
        )
    found = f"MuJoCo cannot draw; {setting}: {first.said}. Only pictures and videos need it"
    return Examined("drawing", Verdict.LOOK, found, remedy, data=data | {"works": works})


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
