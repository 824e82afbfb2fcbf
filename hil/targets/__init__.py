"""Targets: what a test or an experiment runs against, opened by the value that `--hil` takes."""
