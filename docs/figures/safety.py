"""Tables of docs/safety.md."""

from __future__ import annotations

from stopping_times import LATE, STOPPINGS

from figures.results import Rows

SEEDS = range(3)


def stopping() -> Rows:
    """Time from a fault to the beginning of the opening, the shortest and the longest of three."""
    rows = [["fault", *(f"{host} host, s" for host in LATE)]]
    for row in STOPPINGS:
        times = [[row.seconds(host, seed) for seed in SEEDS] for host in LATE]
        rows.append([row.name, *(f"{min(some):.2f} to {max(some):.2f}" for some in times)])
    return rows


TABLES = (stopping,)
