"""Tables of docs/safety.md."""

from __future__ import annotations

from stopping_times import LATE, STOPPINGS

from figures.cells import Cell
from figures.emulated import SEEDED
from figures.sources import Row, Source
from figures.stored import plain, stored

SEEDS = range(3)


def stopping() -> list[Row]:
    """Time from a fault to the beginning of the opening, the shortest and the longest of three."""
    rows: list[Row] = [("fault", *(f"{host} host, s" for host in LATE))]
    for row in STOPPINGS:
        times = [[row.seconds(host, seed) for seed in SEEDS] for host in LATE]
        rows.append((row.name, *(Cell.of("{:.2f} to {:.2f}", min(some), max(some)) for some in times)))
    return rows


TABLES = {
    "stopping": Source(stopping, "Held by `pytest tests/safety/test_stopping_times.py`", SEEDED),
    "busy": stored("busy_host", plain),
}
