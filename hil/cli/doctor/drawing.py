"""Whether MuJoCo can draw here, tried in a process of its own: a wrong OpenGL can end one, or hang it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

from hil.cli.doctor.finding import Examined, Verdict

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
    command = [sys.executable, "-c", PROGRAM]
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
