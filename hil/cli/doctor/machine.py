"""Examination of this machine: Python, installation, MuJoCo's drawing, scheduling jitter."""

import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import PackageNotFoundError, distribution, requires, version
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from aero.clock import Clock, WallClock
from aero.safety import Thresholds
from aero.safety.watch import WORTH_SAYING_S
from hil.cli.doctor.finding import Examined, Verdict
from hil.recordings.provenance import source_commit

PROJECT = "aero-hil"
PATIENCE_S = 30.0
"""Time-out of the OpenGL probe, s (typically 1 s)."""
LOADED, DREW = "loaded", "drew"
# exits without cleanup, because some OpenGL drivers crash in it
PROGRAM = f"""
import os, mujoco
print("{LOADED}", flush=True)
renderer = mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 16, 16)
renderer.render()
print("{DREW}", flush=True)
os._exit(0)
"""
TICK_S, TICKS = 0.005, 200
"""Sampling of one second, with eight ticks per poll of the guard."""


def check_installation() -> Iterator[Examined]:
    """Check Python, this project, its required packages and its extras."""
    here = {"version": platform.python_version(), "system": platform.system(), "machine": platform.machine()}
    found = f"{here['version']} on {here['system']} {platform.release()}, {here['machine']}"
    commit = source_commit()
    try:
        ours = distribution(PROJECT)
    except PackageNotFoundError:
        yield Examined("python", Verdict.OK, found, data=here)
        remedy = "from its folder: pip install -e . in a virtual environment"
        data = {"version": None, "commit": commit}
        yield Examined(PROJECT, Verdict.WRONG, "it runs, but is not installed", remedy, data=data)
        return
    wanted = ours.metadata["Requires-Python"] or ""
    fits = SpecifierSet(wanted).contains(here["version"], prereleases=True)
    remedy = "" if fits else f"{PROJECT} wants Python {wanted}; make a virtual environment with one"
    yield Examined("python", Verdict.OK if fits else Verdict.WRONG, found, remedy, data=here)
    data = {"version": ours.version, "commit": commit}
    yield Examined(PROJECT, Verdict.OK, f"{ours.version}, commit {commit or 'not known'}", data=data)
    base = needs("", _declared, _installed)
    yield Examined("packages", Verdict.OK, ", ".join(f"{name} {found}" for name, found in base.items()), data=base)
    extras = {
        name: needs(name, _declared, _installed) for name in sorted(ours.metadata.get_all("Provides-Extra") or [])
    }
    # an incomplete extra was not requested, so it is not an error
    usable = {name: None not in packages.values() for name, packages in extras.items()}
    lacking = [name for name in extras if not usable[name]]
    said = f"usable: {', '.join(name for name in extras if usable[name]) or 'none'}"
    said += f"; not installed: {', '.join(lacking)}" if lacking else ""
    remedy = "for one of the others, from a checkout: pip install -e '.[NAME]'" if lacking else ""
    figures = {name: {"usable": usable[name], "packages": extras[name]} for name in extras}
    yield Examined("extras", Verdict.OK, said, remedy, data=figures)


def needs(
    extra: str, requires_of: Callable[[str], Sequence[str]], version_of: Callable[[str], str | None]
) -> dict[str, str | None]:
    """Return the packages that an extra needs beyond the project's own dependencies, with their versions.

    Args:
        extra: name of the extra; the project's own dependencies for the name ``.
        requires_of: returns the requirements that an installed package declares, by its name.
        version_of: returns the version of an installed package, or None.
    """

    def walk(package: str, extra: str) -> Iterator[str]:
        for line in requires_of(package):
            requirement = Requirement(line)
            marker = requirement.marker
            always = marker is None or marker.evaluate({"extra": ""})
            if always == bool(extra) or not (marker is None or marker.evaluate({"extra": extra})):
                continue
            name = canonicalize_name(requirement.name)
            if name != PROJECT:
                yield name
            for further in requirement.extras:  # an extra may include other extras, of this project or of others
                yield from walk(name, further)

    return {name: version_of(name) for name in sorted(set(walk(PROJECT, extra)))}


def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _declared(name: str) -> Sequence[str]:
    try:
        return requires(name) or ()
    except PackageNotFoundError:
        return ()


def _drawn() -> tuple[str, str]:
    """Load MuJoCo and draw in another process; return its progress markers and the last error line."""
    command = [sys.executable, "-P", "-c", PROGRAM]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    except subprocess.TimeoutExpired as error:
        out = error.stdout.decode() if isinstance(error.stdout, bytes) else error.stdout or ""
        return out, f"it did not end within {PATIENCE_S:g} s"
    said = [line for line in ran.stderr.splitlines() if line.strip()] or [f"it ended with status {ran.returncode}"]
    return ran.stdout, said[-1]


def check_drawing() -> Examined:
    """Check whether MuJoCo can draw."""
    if find_spec("mujoco") is None:
        return Examined("drawing", Verdict.OK, "MuJoCo is not installed (extra `emulate`), so nothing draws")
    named = os.environ.get("MUJOCO_GL")
    setting = "MUJOCO_GL is not set" if named is None else f"MUJOCO_GL={named}"
    far, said = _drawn()
    loaded, drew = LOADED in far, DREW in far
    data = {"MUJOCO_GL": named, "loaded": loaded, "drew": drew}
    if drew:
        return Examined("drawing", Verdict.OK, f"MuJoCo draws; {setting}", data=data)
    remedy = "unset it, or " if named is not None else ""
    remedy += "set MUJOCO_GL=egl or osmesa, which need no display (Debian: libegl1 or libosmesa6)"
    if not loaded:
        return Examined("drawing", Verdict.WRONG, f"MuJoCo cannot be loaded; {setting}: {said}", remedy, data=data)
    found = f"MuJoCo cannot draw; {setting}: {said}. Only pictures and videos need it"
    return Examined("drawing", Verdict.LOOK, found, remedy, data=data)


def lateness_s(clock: Clock | None = None) -> NDArray[np.float64]:
    """Return the lateness of `TICKS` waits, (n,) s; takes `TICKS * TICK_S` or longer."""
    clock = clock or WallClock()
    late = np.empty(TICKS)
    for tick in range(TICKS):
        due = clock.now() + TICK_S
        clock.sleep_until(due)
        late[tick] = clock.now() - due
    return late


def check_jitter(late_s: NDArray[np.float64]) -> Examined:
    """Judge the lateness of ticks, (n,) s, against the guard's poll period."""
    limits = Thresholds()
    worst, p99 = float(late_s.max()), float(np.quantile(late_s, 0.99))
    found = f"a tick of {1e3 * TICK_S:g} ms came up to {1e3 * worst:.1f} ms late (99 %: {1e3 * p99:.1f} ms)"
    found += f"; the guard of a hand polls every {1e3 * limits.look_s:g} ms"
    data = {"worst_ms": 1e3 * worst, "p99_ms": 1e3 * p99, "ticks": len(late_s), "fine_ms": 1e3 * WORTH_SAYING_S}
    if worst <= WORTH_SAYING_S:
        return Examined("jitter", Verdict.OK, found, data=data)
    verdict = Verdict.LOOK if worst <= limits.silent_s else Verdict.WRONG
    remedy = "end what keeps the machine busy; a fault is noticed later by as much as a poll is late"
    return Examined("jitter", verdict, found, remedy, data=data)
