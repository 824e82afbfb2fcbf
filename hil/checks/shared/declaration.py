"""Declaration of a check: `checks.toml` in its folder, with one table for each measured number.

A `[[metric]]` defines a number; a subject or a group of subjects under `on` overrides keys. The subjects of a group
have similar readings, so they share one limit, computed by `python -m train.limits`.

| key | meaning |
|---|---|
| `evidence` | `EvidenceKind` of a judged number: two numbers of one kind are one piece of evidence |
| `words` | display name; default: the name with blanks |
| `unit` | displayed unit; `length` stands for mm, and mrad for the abduction |
| `motion` | `measured`: the number shows its channel's motion; `needed`, `needed_of_all`: judged only with motion |
| `says` | words for the values 0, 1, 2, ... of a person's answer |
| `end_of_scale` | reading at which the board saturates, so that the true value may lie beyond |
| `side` | faulty side of the healthy readings: `above`, `below` or `both` |
| `recorded` | readings of physical hands, inside the limits by construction; a comment names the source |
| `at_least`, `at_most`, `source` | fixed bound by physics or protocol, in place of the keys above |
| `firmware` | versions of a bound; in a list `bounds`, the one without versions applies to all others |
| `worse` | permitted growth over a hand's baseline, absolute (`by`) or as a fraction (`share`) |
| `column`, `paper`, `differs` | column in the table beside the paper, the paper's number, reason for a difference |
| `published` | figure of the paper's text, with the corresponding metric of the simulator (`model`) |
| `seconds` | `last closing` if only the last closing counts |
| `timed` | true for a time, or a number measured in motion: not judged during a scheduling delay of the computer |
| `optional` | true for a number that may be missing because it has no meaning |
| `samples_in_time` | true for a number that may be missing because too few samples were in time |
| `worst_at` | metric with the time of the worst sample |
| `version` | `VersionRole` in the identification of a board's firmware; default: compared like any other |

The step between two readings follows from the unit; `RESOLUTION` in `check.py` gives it for other metrics.

"The logs": one physical right hand with firmware 0.2.0, public logs of June-July 2026 (TTdragoAlex/
tetherIA-aero-hand-open 58b518e). "The paper": its hand, with firmware `pre`; its table "Sim-to-real validation of the
transmission model" and the sections "Kinematic validation" and "Dynamic validation".
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from typing import Any, Literal

from aero.channels import Channel
from aero.firmware import VERSION_GROUPS
from aero_hil_toml import filled
from hil.checks.shared.subjects import GROUPS

LimitSide = Literal["above", "below", "both"]


class EvidenceKind(Enum):
    """Quantity behind a metric, used by the diagnosis to isolate a fault."""

    TRAVEL = "travel"
    """Position reached or followed."""
    TORQUE = "torque"
    """Current against springs, friction and stops."""
    SPEED = "speed"
    """Duration of a motion under load."""
    JUMP = "jump"
    """Overshoot of a motion."""
    TIME = "time"
    """Delay and shape of a fast motion, which no static load changes."""
    LINK_TIME = "link_time"
    """Delay or period of the replies."""
    STALE = "stale"
    """Readings that stop changing."""
    OWN_SENSOR = "own_sensor"
    """Reading of a servo that depends on no load."""
    WINDOW = "window"
    """Position of the board's command window."""
    CROSSED = "crossed"
    """Motion of another channel than the commanded one."""
    BYTES = "bytes"
    """Bytes lost, added or altered on the link."""
    TEXT = "text"
    """Byte values that a text filter changes."""
    STALL = "stall"
    """Pauses of the link."""
    RESTART = "restart"
    VERSION = "version"
    """Requests that another firmware version does not know."""
    BOOT = "boot"
    """Contradiction between boot text and readings."""
    SENT = "sent"
    """Difference between commands and sent bytes."""
    READ = "read"
    """Difference between received bytes and returned readings."""
    SEEN = "seen"
    """Answer of a person who watched the hand."""


class MotionRole(Enum):
    """Relation of a metric to the motion of its channel."""

    MEASURED = "measured"
    """Distance that the channel moved."""
    NEEDED = "needed"
    """Quantity that only a moving channel has."""
    NEEDED_OF_ALL = "needed_of_all"
    """Comparison with the other channels, valid if all of them move."""


class VersionRole(Enum):
    """Use of a metric in the identification of the firmware on a board by limits of healthy hands."""

    TELLS = "tells"
    """Differs more between versions than between healthy hands."""
    MAP = "map"
    """Depends on the map of the named version, so it cannot identify another."""
    TORQUE = "torque"
    """Depends on the torque limit, which a validation sets to the default of the named version."""


@dataclass(frozen=True)
class Bound:
    """Bound on one metric for subjects with similar readings, and the input of its computed limits."""

    experiment: str
    metric: str
    subjects: tuple[str, ...]
    firmware: tuple[str, ...] = ()
    """Firmware versions of the bound; empty for all."""
    side: LimitSide | None = None
    """Side of healthy readings that is a fault; None for a fixed bound."""
    recorded: tuple[float, float] | None = None
    at_least: float = -math.inf
    at_most: float = math.inf
    source: str = ""

    def __post_init__(self) -> None:
        bounded = math.isfinite(self.at_least) or math.isfinite(self.at_most)
        if self.given != bounded or self.given != bool(self.source):
            raise ValueError(f"check on {self.metric}: give a side, or at_least or at_most with a source")

    @property
    def given(self) -> bool:
        """Whether the bound is fixed instead of computed."""
        return self.side is None


@dataclass(frozen=True)
class Worse:
    """Permitted growth of a number over the hand's baseline; the larger of both fields counts."""

    by: float
    """Absolute growth, in the metric's unit."""
    share: float
    """Growth as a fraction of the baseline's value."""


@dataclass(frozen=True)
class Column:
    """Column of the table beside the paper."""

    place: int
    title: str
    digits: int
    swept: bool = False
    """Whether the thumb is swept alone here, and goes to a fist in the paper."""


@dataclass(frozen=True)
class Published:
    """Figure of the paper's text, with our corresponding metric."""

    figure: str
    """Description of the figure; `{channel}` stands for the subject."""
    says: str = ""
    """Published value with unit; if empty, the paper's number of the metric."""
    subject: str = ""
    """Our subject; if empty, every subject with a number in the paper."""
    model: str = ""
    """Metric of this check with the simulator's value; empty if the simulator has none."""
    note: str = ""
    """Difference between our figure and the published one; empty if there is none."""


@dataclass(frozen=True)
class Metric:
    """Number that a check measures on subjects with similar readings."""

    name: str
    """Name in `checks.json` and in the limits."""
    words: str
    unit: str
    subjects: tuple[str, ...]
    evidence: EvidenceKind | None = None
    """Kind of evidence; None for a number without bounds."""
    end_of_scale: float = math.inf
    says: tuple[str, ...] = ()
    """Words for the values of a person's answer; empty for a number."""
    bounds: tuple[Bound, ...] = ()
    """Bounds; empty for a number that is not judged."""
    worse: Worse | None = None
    trend: int = 0
    """Column of the history page, from 1; 0 for the list of further readings."""
    column: Column | None = None
    plotted: str = ""
    """Row of the plots over time whose samples are the number; empty for means, slopes, times and shares."""
    paper: Mapping[str, float] = field(default_factory=dict)
    """Number of the paper by subject."""
    differs: str = ""
    published: tuple[Published, ...] = ()
    seconds: str = ""
    worst_at: str = ""
    motion: MotionRole | None = None
    """Relation to the motion of the channel, or None."""
    timed: bool = False
    """Whether scheduling delays of this computer invalidate the number."""
    optional: bool = False
    """Whether the number may be missing where it has no meaning, such as without a load."""
    samples_in_time: bool = False
    """Whether the number may be missing if too few samples were in time."""
    version: VersionRole | None = None
    """Use in the identification of the firmware, or None for a reading like any other."""

    def text(self, value: float | None) -> str:
        """Return a value as text with its unit; None means withheld."""
        if value is None:
            return "not judged"
        if math.isnan(value):
            return "not measurable"
        return self.says[round(value)] if self.says else f"{number(value)} {self.unit}"


def number(value: float) -> str:
    """Return a number with four digits, without an exponent if large."""
    return f"{value:z.0f}" if abs(value) >= 1e4 else f"{value:z.4g}"


BOUND = {field.name for field in fields(Bound)} - {"experiment", "metric", "subjects"}


def parse_metric(experiment: str, table: Mapping[str, Any]) -> Iterator[Metric]:
    """Yield a metric for each group of subjects in a `[[metric]]` table.

    Raises:
        ValueError: the table has a mistake; the message names the metric.
    """
    own, name = dict(table), table.get("name", "?")
    on, published = own.pop("on", ()), tuple(Published(**row) for row in own.pop("published", ()))
    groups: Mapping[str, Mapping[str, Any]] = on if isinstance(on, dict) else {group: {} for group in on}
    for group, differing in groups.items():
        merged = {**own, **differing}
        if group not in GROUPS:
            raise ValueError(f"check on {name}: `on` names {', '.join(GROUPS)}, not {group}")
        if "evidence" not in merged and BOUND & merged.keys():
            raise ValueError(f"check on {name}: its bounds need `evidence`")
        yield _metric(experiment, GROUPS[group], merged, published)


def parse_bounds(experiment: str, subjects: tuple[str, ...], table: Mapping[str, Any]) -> tuple[Bound, ...]:
    """Return the bounds of one group of subjects.

    Raises:
        ValueError: neither a side nor a bound with its source.
    """
    common = {key: table[key] for key in BOUND & table.keys()}
    bounds = [common | bound for bound in table.get("bounds", [{}])]
    named = {version for bound in bounds for version in bound.get("firmware", ())}
    others = tuple(version for group in VERSION_GROUPS if named and named.isdisjoint(group) for version in group)
    of = {"experiment": experiment, "metric": table["name"], "subjects": subjects, "firmware": others}
    return tuple(filled(Bound, of | bound, f"check on {table['name']}") for bound in bounds if bound)


def _metric(
    experiment: str, subjects: tuple[str, ...], table: Mapping[str, Any], published: tuple[Published, ...]
) -> Metric:
    paper = table.get("paper", {})
    by_group = paper if isinstance(paper, dict) else dict.fromkeys(subjects, paper)
    numbers = {subject: by_group[group] for group in by_group for subject in GROUPS[group] if subject in subjects}
    figures = [figure for figure in published if figure.subject] + [
        replace(
            figure,
            figure=figure.figure.format(channel=Channel[subject.upper()].title),
            says=f"{number:g} {table['unit']}",
            subject=subject,
        )
        for figure in published
        for subject, number in numbers.items()
        if not figure.subject
    ]
    own = {key: value for key, value in table.items() if key not in BOUND | {"bounds"}}
    words = {"words": table["name"].replace("_", " "), "subjects": subjects}
    metric = filled(Metric, words | own | {"paper": numbers}, f"check on {table['name']}")
    return replace(
        metric,
        bounds=parse_bounds(experiment, subjects, table),
        published=tuple(figure for figure in figures if figure.subject in subjects),
    )
