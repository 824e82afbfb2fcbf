"""Targets of tests and experiments, opened by the value of `--hil`."""

from aero_hil import hidden

if _line := hidden():
    raise ImportError(_line)
