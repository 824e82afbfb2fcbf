"""Examples that stand alone; each folder is one, run from a checkout as `python -m examples.NAME`."""
