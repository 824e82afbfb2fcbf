"""Fit the lines of `aero.policy.cables` to healthy hands with wrong cables: `python -m train.cable_measurement`.

Writes the file that ships beside the policy's weights.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tomli_w

from aero.channels import CABLES, FINGERS, Channel
from aero.floats import Floats
from aero.policy.cables import LINES_FILE, TORQUE_SHARE, Line, Seen, Travels, observed, record
from aero.policy.settings import PolicySettings
from aero.policy.shipped import DEFAULT, find_policy
from aero.whole_file import write_whole
from hil.emulated.any_hand import open_emulated
from hil.emulated.emulated_spec import EmulatedSpec
from model.units.cable_correction import correction
from model.units.conditions import Conditions
from model.units.plausible import plausible_unit
from simulator.scene import CUBE
from train.workers import usable_cores, worker_processes

SEEDS = range(720_000, 720_080)
"""Seeds of the hands; no evaluation uses them."""
WRONG_M = 3e-3
"""Half width of the uniform error of each cable's length, m."""
CABLE_STREAM = 4
"""Random stream of a hand's seed for the errors of its cables."""
THUMB_SLOPE = {Channel.THUMB_FLEXOR}
"""Cables whose slack depends on the CMC cable as well."""


class Example(NamedTuple):
    """Observations of one hand, with its exact correction (7,), m, abduction rad."""

    seen: dict[Channel, Travels]
    correction: Floats


def wrong_cables(seed: int, most_m: float = WRONG_M) -> Conditions:
    """Return the condition of cables that are wrong by up to `most_m`, drawn from a hand's seed."""
    drawn = np.random.default_rng((seed, CABLE_STREAM)).uniform(-most_m, most_m, len(Channel))
    return Conditions(pretension_m=tuple(np.where(np.isin(list(Channel), CABLES), drawn, 0.0).tolist()))


def example(seed: int, settings: PolicySettings) -> Example:
    """Measure the hand `plausible:SEED` with wrong cables; its digits meet each other and the palm."""
    wrong = wrong_cables(seed)
    # A hand without a cube is emulated without contacts of its digits.
    spec = EmulatedSpec(unit=f"plausible:{seed}", seed=seed, guarded=True, conditions=wrong, cube=CUBE)
    with open_emulated(spec) as opened:
        assert opened.guard is not None
        opened.guard.limit_torques(TORQUE_SHARE)
        samples = record(opened.hand, opened.clock, opened.map, to_stops=True, moved=lambda _: None)
    return Example(observed(samples), correction(wrong.applied(plausible_unit(seed)), settings))


def fitted(examples: Sequence[Example]) -> dict[tuple[Channel, Seen], Line]:
    """Return the line of each cable and observation; the fingers share theirs."""
    groups: Mapping[tuple[Channel, ...], tuple[Seen, ...]] = {
        tuple(FINGERS): (Seen.SLACK, Seen.STOP, Seen.NEITHER),
        (Channel.THUMB_CMC_FLEXION,): (Seen.STOP,),  # its window begins beyond the slack of any healthy cable
        (Channel.THUMB_FLEXOR,): (Seen.SLACK, Seen.STOP),
    }
    return {
        (channel, kind): line
        for group, kinds in groups.items()
        for kind in kinds
        for line in [_line(examples, group, kind)]
        for channel in group
    }


def _line(examples: Sequence[Example], group: Sequence[Channel], kind: Seen) -> Line:
    """Fit one line by least squares."""
    with_thumb = kind is Seen.SLACK and set(group) <= THUMB_SLOPE
    rows = []
    for one in examples:
        thumb = one.seen[Channel.THUMB_CMC_FLEXION].stop if with_thumb else 0.0
        for channel in group:
            slack, stop = one.seen[channel]
            taut = np.isnan(slack) or channel in THUMB_SLOPE
            own = {Seen.SLACK: slack, Seen.STOP: stop, Seen.NEITHER: 0.0 if np.isinf(stop) else np.nan}[kind]
            rows.append((1.0, own if taut or kind is Seen.SLACK else np.nan, thumb, one.correction[channel]))
    table = np.array(rows)
    table = table[np.isfinite(table).all(axis=1)]
    found = np.linalg.lstsq(table[:, :3], table[:, 3])[0]
    deviation = float(np.sqrt(np.mean((table[:, :3] @ found - table[:, 3]) ** 2)))
    offset, own, thumb = found.tolist()
    return Line(offset, own, thumb, deviation)


def as_toml(fits: Mapping[tuple[Channel, Seen], Line]) -> str:
    """Return the file's text."""
    heads = [
        "# Made by `python -m train.cable_measurement`",
        f"# from plausible:{SEEDS[0]} to plausible:{SEEDS[-1]}, each cable wrong by up to {1e3 * WRONG_M:g} mm.",
        "# Corrections by observed travels: m, slopes m/m.",
    ]
    tables: dict[str, dict[str, dict[str, float]]] = {channel.label: {} for channel in CABLES}
    for (channel, kind), line in fits.items():
        tables[channel.label][kind.value] = {name: round(value, 6) for name, value in line._asdict().items()}
    return "\n".join(heads) + "\n\n" + tomli_w.dumps(tables)


def made() -> str:
    """Return the text of the file from all hands."""
    with worker_processes(usable_cores()) as workers:
        return as_toml(fitted(list(workers.map(partial(example, settings=find_policy(DEFAULT).settings), SEEDS))))


if __name__ == "__main__":
    write_whole(Path(str(files("aero.policy.shipped") / LINES_FILE)), made())
