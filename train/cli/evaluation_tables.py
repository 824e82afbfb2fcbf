"""Tables of `aero-hil evaluate`: on a narrow terminal in several parts, and never with a number cut."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan, nan

from rich.console import Console

from hil.cli.terminal import print_columns

FIGURES = {
    "survival": ("keeps", "{:.0%}"),
    "rate_rad_s": ("rad/s", "{:.2f}"),
    "rotation_median_rad": ("rad", "{:.1f}"),
    "turned_share": ("> 0.1", "{:.0%}"),
    "airborne": ("no contact", "{:.2%}"),
    "let_go": ("> 0.5 mm", "{:.2%}"),
    "action_change": ("change", "{:.2f}"),
    "finger_travel_m_s": ("mm/s", "{:.1f}"),
    "stopped": ("stopped", "{:.0%}"),
    "mean_current_a": ("mean A", "{:.2f}"),
    "peak_current_a": ("peak A", "{:.2f}"),
    "held_15_s": ("held 15 s", "{:.0%}"),
    "held_50_s": ("held 50 s", "{:.0%}"),
    "held_200_s": ("held 200 s", "{:.0%}"),
}
"""Heading and format of each figure: share that keeps the cube, rate, median rotation, share above 0.1 rad/s, steps
without contact, samples with nothing within 0.5 mm of the cube, change of the action from step to step, commanded
travel of a finger, share of trials that something ended, current of the motor that draws most, mean and peak, share
that still held the cube after a time."""
SCALE = {"finger_travel_m_s": 1e3}


def print_figures(console: Console, title: str, rows: Mapping[str, Mapping[str, float]]) -> None:
    """Print a row a condition, a column a figure, with its interval of 95 % where it has one."""
    shown = {key: column for key, column in FIGURES.items() if any(key in row for row in rows.values())}
    heads = [head for head, _ in shown.values()]
    cells = {name: [_cell(row, key, form) for key, (_, form) in shown.items()] for name, row in rows.items()}
    print_columns(console, title, heads, cells)


def _cell(row: Mapping[str, float], key: str, form: str) -> str:
    if key not in row:
        return ""
    scale = SCALE.get(key, 1.0)
    low, high = row.get(f"{key}_low", nan), row.get(f"{key}_high", nan)
    interval = "" if isnan(low) else f" ({form.format(low * scale)}-{form.format(high * scale)})"
    return form.format(row[key] * scale) + interval
