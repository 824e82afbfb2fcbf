"""How the figures of `aero-hil evaluate` are shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan, nan

import numpy as np
from rich.console import Console
from rich.table import Table

from hil.lab.policies.cube_trial import CubeTrial
from hil.lab.policies.mismatches import Lost
from hil.lab.policies.prediction import Interval
from hil.lab.policies.strata import Stratum
from hil.lab.policies.survival import MOMENTS_S, still_held
from hil.lab.policies.transmission_gap import ChannelGap

COLUMNS = {
    "survival": ("keeps", "{:.2f}"),
    "rate_rad_s": ("rad/s", "{:.2f}"),
    "rotation_median_rad": ("rad", "{:.1f}"),
    "turned_share": ("> 0.1", "{:.0%}"),
    "airborne": ("no contact", "{:.2%}"),
    "let_go": ("> 0.5 mm", "{:.2%}"),
    "action_change": ("change", "{:.2f}"),
    "finger_travel_m_s": ("mm/s", "{:.1f}"),
    "stopped": ("stopped", "{:.2f}"),
    "mean_current_a": ("mean A", "{:.2f}"),
    "peak_current_a": ("peak A", "{:.2f}"),
}
"""Heading and format of each figure: share that keeps the cube, mean rate, median rotation, share above 0.1 rad/s,
steps without contact, looks with nothing within 0.5 mm of the cube, change of the action from step to step, commanded
travel of a finger, share of trials that a limit ended, motor current of the channel that draws most, mean and peak."""
MM = 1e3


def print_figures(console: Console, backend: str, rows: Mapping[str, Mapping[str, float]]) -> None:
    """Print one table for a backend: a row a condition, a column a figure."""
    shown = {key: column for key, column in COLUMNS.items() if any(key in row for row in rows.values())}
    table = Table(title=backend, title_justify="left")
    table.add_column("", no_wrap=True)
    for title, _ in shown.values():
        table.add_column(title, justify="right")
    scale = {"finger_travel_m_s": MM}
    for name, row in rows.items():
        table.add_row(name, *(_cell(row, key, form, scale.get(key, 1.0)) for key, (_, form) in shown.items()))
    console.print(table)


def print_survival(console: Console, rows: Mapping[str, Sequence[CubeTrial]]) -> None:
    """Print which share of the trials of each row still holds the cube after a time, and how fast they turn it."""
    table = Table(title="Still held, every byte", title_justify="left")
    table.add_column("", no_wrap=True)
    for after_s in MOMENTS_S:
        table.add_column(f"{after_s:g} s", justify="right")
    table.add_column("rad/s", justify="right")
    for name, trials in rows.items():
        shares = [f"{one.share:.0%} ({one.interval[0]:.0%}-{one.interval[1]:.0%})" for one in still_held(trials)]
        table.add_row(name, *shares, f"{np.mean([one.rate_rad_s for one in trials]):.2f}")
    console.print(table)


def print_strata(console: Console, rows: Sequence[Stratum]) -> None:
    """Print what the trials of each stratum came to."""
    table = Table(title="Any cube by what it is like; intervals of 95 %", title_justify="left")
    table.add_column("", no_wrap=True)
    for title in ("trials", "keeps", "rad/s", "above 0.1 rad/s"):
        table.add_column(title, justify="right")
    for row in rows:
        if row.trials:
            table.add_row(
                row.label,
                str(row.trials),
                _share(row.kept, row.kept_interval),
                f"{row.rate_rad_s:.2f}",
                _share(row.turned, row.turned_interval),
            )
    console.print(table)


def print_lost(console: Console, rows: Sequence[Lost]) -> None:
    """Print what each mismatch costs."""
    table = Table(
        title="What each mismatch costs, trial by trial against none; intervals of 95 %", title_justify="left"
    )
    table.add_column("", no_wrap=True)
    for title in ("trials", "keeps", "rad/s", "rad/s lost"):
        table.add_column(title, justify="right")
    for row in rows:
        low, high = row.interval
        cost = "" if isnan(low) else f"{row.lost_rad_s:.3f} ({low:.3f} to {high:.3f})"
        table.add_row(row.name, str(row.trials), f"{row.kept:.0%}", f"{row.rate_rad_s:.3f}", cost)
    console.print(table)


def _share(value: float, interval: Interval) -> str:
    return f"{value:.0%} ({interval[0]:.0%}-{interval[1]:.0%})"


def _cell(row: Mapping[str, float], key: str, form: str, scale: float) -> str:
    """Return a figure, with its 95 % interval where it has one."""
    low, high = row.get(f"{key}_low", nan), row.get(f"{key}_high", nan)
    interval = "" if isnan(low) else f" ({form.format(low * scale)}-{form.format(high * scale)})"
    return form.format(row[key] * scale) + interval


def print_gaps(console: Console, gaps: tuple[ChannelGap, ...]) -> None:
    """Print what one episode's actions move in the simulator, replayed on the hand, and in closed loop."""
    table = Table(title="Motion with one episode's actions, mm or mrad (standard deviation)", title_justify="left")
    table.add_column("", no_wrap=True)
    for title in ("sim", "replayed", "rest", "offset", "closed loop"):
        table.add_column(title, justify="right")
    table.add_column("gap from", no_wrap=True)
    for gap in gaps:
        figures = (gap.simulated, gap.replayed, gap.residual, gap.offset, gap.closed_loop)
        table.add_row(gap.channel.label, *(f"{MM * figure:.2f}" for figure in figures), gap.cause)
    console.print(table)
