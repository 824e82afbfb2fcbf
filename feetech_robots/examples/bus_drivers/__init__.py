"""Adapters of three public drivers for `pytest tests/bus_driver --bus-driver=...`; see docs/bus_drivers.md."""
