"""One self-contained HTML page about one run of experiments: verdict first, then why, then everything it rests on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from aero.channels import Channel
from hil.diagnosis.sight import load_sight
from hil.experiments import EXPERIMENTS
from hil.experiments.staircase.residual_sources import residual_sources
from hil.experiments.staircase.tracking import ChannelMetrics, staircase_metrics
from hil.judging.findings import Finding, failed
from hil.judging.judged_run import Validation
from hil.judging.paper_figures import PAPER, PAPER_TEXT, PaperFigure
from hil.recordings.recording import Recording
from hil.report.plots import as_svg, draw_series, figures_of, title


@dataclass(frozen=True)
class Cell:
    """A measured number beside the paper's, both as text."""

    name: str
    short: str
    """Name for a narrow column."""
    ours: str
    paper: str
    limit: str


@dataclass(frozen=True)
class Row:
    """One channel's line of the table."""

    title: str
    unit: str
    cells: tuple[Cell, ...]


def table(metrics: Mapping[Channel, ChannelMetrics], findings: Iterable[Finding] = ()) -> tuple[Row, ...]:
    """Return the validation table, one row a channel, each number beside the paper's and its limit."""
    limits = limits_of(findings)
    return tuple(_row(channel, row, limits) for channel, row in metrics.items())


@dataclass(frozen=True)
class TextRow:
    """A number of the paper's text beside ours."""

    name: str
    paper: str
    model: str
    ours: str
    limit: str
    note: str


def render_report(validation: Validation) -> str:
    """Return the page for a run of experiments; it loads nothing from anywhere.

    Raises:
        ValueError: nothing was recorded, so there is nothing to report on.
    """
    recordings = [*(result.recording for result in validation.results.values()), *validation.broken_off]
    if not recordings:
        raise ValueError("no experiment began; there is nothing to report on")
    environment = Environment(
        loader=PackageLoader("hil.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2").render(
        header=recordings[0].header,
        validation=validation,
        failures=failed(validation.findings),
        sight=_sight(validation),
        staircase=_staircase(validation),
        text_rows=[_text_row(figure, validation) for figure in PAPER_TEXT if _shown(figure, validation)],
        figures=_figures(validation),
        broken_off=[(recording.header, _traces(recording)) for recording in validation.broken_off],
        ran={name: EXPERIMENTS[name].title for name in validation.results},
        events=[(recording.header.experiment, event) for recording in recordings for event in recording.events],
        subjects=(*(channel.label for channel in Channel), "hand"),
    )


def _sight(validation: Validation) -> dict[str, str]:
    """Return, by the sentence of a failed finding, what its check is worth; nothing for one that no campaign tried."""
    known = load_sight()
    return {
        finding.sentence: known[f"{name}/{finding.check}"].sentence
        for name, result in validation.judged.items()
        for finding in failed(result.findings)
        if f"{name}/{finding.check}" in known
    }


def _staircase(validation: Validation) -> dict[str, Any] | None:
    """Return what the page says about the staircase, None when there was none."""
    result = validation.measured("staircase")
    if result is None:
        return None
    recording = result.recording
    metrics, attributions = staircase_metrics(recording), residual_sources(recording)
    return {
        "rows": table(metrics, result.findings),
        "causes": [(title(channel), row, attributions[channel]) for channel, row in metrics.items()],
    }


def _figures(validation: Validation) -> dict[str, dict[str, str]]:
    """Return the page's figures: experiment to panel to SVG."""
    drawn = {name: figures_of(name, result.recording) for name, result in validation.results.items() if result.measured}
    return {name: {panel: as_svg(draw) for panel, draw in draws.items()} for name, draws in drawn.items() if draws}


def _traces(recording: Recording) -> dict[str, str]:
    """Return a figure of every series that an experiment left before it was broken off: name to SVG."""
    return {
        name: as_svg(partial(draw_series, recording=recording, name=name, unit=series.units[0]))
        for name, series in recording.series.items()
    }


def _shown(figure: PaperFigure, validation: Validation) -> bool:
    """Whether there is a number, or a reason why there is none, to show beside the paper's."""
    return not figure.experiment or validation.measured(figure.experiment) is not None


def _text_row(figure: PaperFigure, validation: Validation) -> TextRow:
    if not figure.experiment:
        return TextRow(figure.name, figure.paper, "", "not measured", "", figure.note)
    result = validation.results[figure.experiment]
    ours = f"{result.measured[figure.subject][figure.metric]:.4g} {figure.unit}"
    model, staircase = "", validation.measured("staircase")
    if figure.model and staircase is not None:
        model = f"{staircase.measured[figure.subject][figure.model]:.4g} {figure.unit}"
    limits = limits_of(result.findings).get((figure.metric, figure.subject), "none")
    return TextRow(figure.name, figure.paper, model, ours, limits, figure.note)


def limits_of(findings: Iterable[Finding]) -> dict[tuple[str, str], str]:
    """Return the limit of each check and subject, as people read it."""
    return {(finding.check, finding.subject): finding.expected for finding in findings}


def _row(channel: Channel, row: ChannelMetrics, limits: Mapping[tuple[str, str], str]) -> Row:
    paper = PAPER[channel]
    cells = (
        ("Excursion, simulator", "model\nspan", "excursion_model", 2, None),
        ("Excursion, hand", "hand\nspan", "excursion_hand", 2, paper.excursion_hand),
        ("Tracking RMS", "RMS", "tracking_rms", 2, paper.tracking_rms),
        ("Rise, simulator, ms", "model\nrise", "rise_model_ms", 0, paper.rise_model_ms),
        ("Rise, hand, ms", "hand\nrise", "rise_hand_ms", 0, paper.rise_hand_ms),
        ("Overshoot, hand, %", "over\n%", "overshoot_hand_percent", 1, 0.0),
        ("Settled samples", "settled", "settled_samples", 0, None),
        ("Matched steps", "steps", "matched_steps", 0, None),
    )
    return Row(
        title(channel),
        row.unit,
        tuple(
            Cell(
                name,
                short,
                _number(getattr(row, metric), digits),
                "" if published is None else _number(published, digits),
                limits.get((metric, channel.label), ""),
            )
            for name, short, metric, digits, published in cells
        ),
    )


def _number(value: float, digits: int) -> str:
    return "none" if math.isnan(value) else f"{value:.{digits}f}"
