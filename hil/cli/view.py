"""`aero-hil view`: recording in a web page, with a time line."""

from contextlib import suppress
from pathlib import Path

import click

from hil.checks import EXPERIMENTS
from hil.cli.exits import judging, usage_errors
from hil.cli.options import RECORDING
from hil.dialogue.printing import echo
from hil.recordings.mcap_file import read_recording
from hil.recordings.recording import Header
from hil.targets.hand_spec import hand_words
from hil.verdict.findings import failed
from hil.verdict.validation import judge_recordings
from hil.view.frame import Heading, Note, Verdicts
from hil.view.sources import frames
from hil.view.web_page import Page


@click.command()
@click.argument("recording", type=RECORDING)
def view(*, recording: Path) -> None:
    """Play RECORDING in a web page on this machine, until Ctrl-C.

    The posture is estimated from the encoders by the actuation map. The recording of an experiment is judged again.
    """
    with usage_errors():
        recorded = read_recording(recording)
    header = recorded.header
    with judging(recording):
        shown = frames(recorded)
        page = Page(Heading(_title(header), header.hand, live=False))
    for frame in shown:
        page.show(frame)
    for event in recorded.events:
        page.show(Note(event.t, event.text, event.severity))
    if header.experiment in EXPERIMENTS and header.finished:
        with judging(recording):
            findings = judge_recordings([recorded]).findings
        failures = failed(findings)
        page.show(Verdicts(len(findings) - len(failures), tuple(finding.sentence for finding in failures)))
    echo(f"view {page.url}", err=True)
    with suppress(KeyboardInterrupt):
        while True:
            page.tick()
    page.close()


def _title(header: Header) -> str:
    words = hand_words(
        header.hand, header.target, header.firmware, unit=header.unit, seed=header.seed, hand_id=header.hand_id,
        wrong=header.faults,
    )  # fmt: skip
    when = f", {header.started[:19].replace('T', ' ')}" if header.started else ""
    return f"{header.experiment}: {words}{when}"
