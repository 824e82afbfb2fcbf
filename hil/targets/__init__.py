"""Targets: what a test or an experiment runs against, opened by the value that `--hil` takes."""

from aero_hil import hidden

if _line := hidden():
    raise ImportError(_line)
