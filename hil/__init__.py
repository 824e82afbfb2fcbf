"""Experiments, metrics, limits and reports over whatever stands right of the driver."""
