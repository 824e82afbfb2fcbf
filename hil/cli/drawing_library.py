"""Which library MuJoCo draws with, said before MuJoCo is imported.

Left alone, the package `glfw` starts Python once more for each library that it finds. When a command is killed
meanwhile, that second process leaves a traceback.
"""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

VARIABLE = "PYGLFW_LIBRARY"


def name_it() -> None:
    """Name the library that comes with `glfw`, where there is one and none is named; other processes inherit it."""
    found = find_spec("glfw")
    if found is None or VARIABLE in os.environ:
        return
    variant = "wayland" if os.environ.get("XDG_SESSION_TYPE") == "wayland" else "x11"
    for folder in found.submodule_search_locations or ():
        library = Path(folder, variant, "libglfw.so")
        if library.is_file():
            os.environ[VARIABLE] = str(library)
