"""Import of MJX without its two lines about an absent backend.

MuJoCo's package prints "Failed to import warp" at every start; no other way to leave the text out is provided. Import
this module before Brax, which imports MJX.
"""

import sys
from contextlib import redirect_stdout
from io import StringIO

with redirect_stdout(StringIO()) as _said:
    import mujoco.mjx  # noqa: F401

for _line in _said.getvalue().splitlines():
    if "warp" not in _line:
        print(_line, file=sys.stderr)
