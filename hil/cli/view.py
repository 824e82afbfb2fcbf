"""`aero-hil view`: recording in a web page, with a time line; live readings of a port."""

from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import click

from aero.exit_code import Exit
from hil.checks import EXPERIMENTS
from hil.cli.exits import Ended, judging, usage_errors
from hil.cli.live_view import show_live
from hil.cli.options import RECORDING
from hil.dialogue.printing import echo
from hil.recordings.mcap_file import read_recording
from hil.recordings.recording import Header
from hil.targets.hand_spec import hand_words, named_port
from hil.verdict.findings import failed
from hil.verdict.validation import judge_recordings
from hil.view.frame import Heading, Note, Verdicts
from hil.view.sources import frames


@click.command()
@click.argument("recording", type=RECORDING, required=False)
@click.option("--hil", "port", metavar="PORT", help="Show the live readings of the hand at PORT, or of a name.")
def view(*, recording: Path | None, port: str | None) -> None:
    """Play RECORDING in a web page on this machine, or show the live readings of a port, until Ctrl-C.

    The posture is estimated from the encoders by the actuation map. The recording of an experiment is judged again.
    Live readings come as a table on the terminal and, with the extra `view`, on a page; no hand is commanded.
    """
    if (recording is None) == (port is None):
        raise click.UsageError("give either a recording, or a port with --hil")
    if recording is None:
        with usage_errors():
            spec = named_port(port or "", guarded=False)
        show_live(spec)
        return
    if find_spec("viser") is None:
        raise Ended("a recording's page needs the extra `view`; from a checkout: pip install -e '.[view]'", Exit.USAGE)
    from hil.view.web_page import Page  # noqa: PLC0415 - needs the extra `view`

    with usage_errors():
        recorded = read_recording(recording)
    header = recorded.header
    with judging(recording):
        shown = frames(recorded)
        page = Page(Heading(_title(header), header.side, live=False))
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
        header.side, header.target, header.firmware, unit=header.unit, seed=header.seed, hand_id=header.hand_id,
        wrong=header.faults,
    )  # fmt: skip
    when = f", {header.started[:19].replace('T', ' ')}" if header.started else ""
    return f"{header.experiment}: {words}{when}"
