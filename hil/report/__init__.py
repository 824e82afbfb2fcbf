"""One self-contained HTML page about one run of experiments: verdict first, then why, then everything it rests on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from aero.channels import Channel
from hil.experiments import EXPERIMENTS
from hil.findings import failed
from hil.metrics import ChannelMetrics, staircase_metrics
from hil.plots import as_svg, figures_of, title
from hil.reference import PAPER, PAPER_TEXT, PaperFigure
from hil.residuals import attribute

if TYPE_CHECKING:
    from hil.validation import Validation


@dataclass(frozen=True)
class Cell:
    """A measured number beside the paper's, both as text."""

    name: str
    short: str
    """Name for a narrow column."""
    ours: str
    paper: str = ""


@dataclass(frozen=True)
class Row:
    """One channel's line of the table."""

    title: str
    unit: str
    cells: tuple[Cell, ...]


def table(metrics: Mapping[Channel, ChannelMetrics]) -> tuple[Row, ...]:
    """Return the validation table, one row a channel, each number beside the paper's."""
    return tuple(_row(channel, row) for channel, row in metrics.items())


@dataclass(frozen=True)
class TextRow:
    """A number of the paper's text beside ours."""

    name: str
    paper: str
    ours: str
    note: str


def render_report(validation: Validation) -> str:
    """Return the page for a run of experiments; it loads nothing from anywhere.

    Raises:
        ValueError: no experiment ran to its end, so there is nothing to report on.
    """
    if not validation.results:
        raise ValueError("no experiment ran to its end; there is nothing to report on")
    environment = Environment(
        loader=PackageLoader(__name__), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    first = next(iter(validation.results.values())).recording
    return environment.get_template("report.html.j2").render(
        header=first.header,
        validation=validation,
        failures=failed(validation.findings),
        staircase=_staircase(validation),
        text_rows=[_text_row(figure, validation) for figure in PAPER_TEXT],
        figures=_figures(validation),
        ran={name: EXPERIMENTS[name].title for name in validation.results},
        events=[(name, event) for name, result in validation.results.items() for event in result.recording.events],
        subjects=(*(channel.label for channel in Channel), "hand"),
    )


def _staircase(validation: Validation) -> dict[str, Any] | None:
    """Return what the page says about the staircase, None when there was none."""
    if "staircase" not in validation.results:
        return None
    recording = validation.results["staircase"].recording
    metrics, attributions = staircase_metrics(recording), attribute(recording)
    return {
        "rows": table(metrics),
        "causes": [(title(channel), row, attributions[channel]) for channel, row in metrics.items()],
    }


def _figures(validation: Validation) -> dict[str, dict[str, str]]:
    """Return the page's figures: experiment to panel to SVG."""
    drawn = {name: figures_of(name, result.recording) for name, result in validation.results.items()}
    return {name: {panel: as_svg(draw) for panel, draw in draws.items()} for name, draws in drawn.items() if draws}


def _text_row(figure: PaperFigure, validation: Validation) -> TextRow:
    if figure.experiment not in validation.results:
        return TextRow(figure.name, figure.paper, "not measured", figure.note or f"run with --only {figure.experiment}")
    value = validation.results[figure.experiment].measured[figure.subject][figure.metric]
    return TextRow(figure.name, figure.paper, f"{value:.3g} {figure.unit}", figure.note)


def _row(channel: Channel, row: ChannelMetrics) -> Row:
    paper = PAPER[channel]
    return Row(
        title(channel),
        row.unit,
        (
            Cell("Excursion, simulator", "model\nspan", _number(row.excursion_model)),
            Cell("Excursion, hand", "hand\nspan", _number(row.excursion_hand), _number(paper.excursion_hand)),
            Cell("Tracking RMS", "RMS", _number(row.tracking_rms), _number(paper.tracking_rms)),
            Cell("Rise, simulator, ms", "model\nrise", _number(row.rise_model_ms, 0), _number(paper.rise_model_ms, 0)),
            Cell("Rise, hand, ms", "hand\nrise", _number(row.rise_hand_ms, 0), _number(paper.rise_hand_ms, 0)),
            Cell("Overshoot, hand, %", "over\n%", _number(row.overshoot_hand_percent, 1), "0"),
            Cell("Settled samples", "settled", str(row.settled_samples)),
            Cell("Matched steps", "steps", str(row.matched_steps), "72-177"),
        ),
    )


def _number(value: float, digits: int = 2) -> str:
    return "none" if math.isnan(value) else f"{value:.{digits}f}"
