"""Implementation of `aero-hil validate`, separate from its options because it imports MuJoCo and a plotting library."""

import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from aero.exit_code import Exit
from aero.safety import SafetyStopError
from aero.safety.interrupts import let_through_at_entry, stops_held, stops_let_through
from hil.checks import DEFAULT, EXPERIMENTS
from hil.checks.shared.experiment import Experiment
from hil.cli.exits import Ended, ending, usage_errors
from hil.cli.options import open_hand
from hil.cli.output_files import FOLDER
from hil.dialogue.asker import Choice, Option
from hil.dialogue.before_moving import motion, readings
from hil.dialogue.page_asker import PageAsker
from hil.dialogue.printing import echo
from hil.dialogue.terminal import ProgressBar
from hil.dialogue.terminal import console as new_console
from hil.dialogue.terminal_asker import TerminalAsker
from hil.dialogue.viewing import asking, telling
from hil.emulated.emulated_case import hand_of_case
from hil.emulated.emulated_spec import with_fields
from hil.recordings.output import claimed, emptied, run_folder
from hil.report.results import write_case_of, write_figures, write_results
from hil.report.run_folder import clear_run, require_no_steps
from hil.report.text import result_line, run_text
from hil.targets.hand_errors import FaultNeverFiredError
from hil.targets.hand_spec import PortSpec
from hil.verdict.baseline import load
from hil.verdict.case_file import HandOfCase
from hil.verdict.diagnosis import Diagnosis
from hil.verdict.findings import failed
from hil.verdict.judged_run import Validation
from hil.verdict.run_end import EndKind, ended_at_closing
from hil.verdict.validation import validate as run_validation
from hil.view.feed import Observer
from hil.view.frame import Moving
from hil.view.sources import source_of


class RunProgress:
    """Progress of a validation, weighted by the experiments' hand time.

    Shown as a bar on a terminal, otherwise as one line per experiment on standard error.
    """

    def __init__(self, bar: ProgressBar, experiments: Sequence[Experiment], observer: Observer) -> None:
        """Start at 0 % of all experiments."""
        self._bar, self._experiments, self._observer = bar, experiments, observer
        self._total_s = sum(experiment.hand_s for experiment in experiments)
        self._done = 0
        self._task = bar.add_task("opening", total=1.0)

    def step(self, done: float, doing: str) -> None:
        """Update the finished fraction, 0 to 1, of the current experiment."""
        before_s = sum(experiment.hand_s for experiment in self._experiments[: self._done])
        present = self._experiments[min(self._done, len(self._experiments) - 1)]
        words = f"{min(self._done + 1, len(self._experiments))} of {len(self._experiments)}, {present.name}: {doing}"
        part = (before_s + done * present.hand_s) / self._total_s
        self._bar.update(self._task, completed=part, description=words)
        self._observer.show(Moving("", part, words, (1.0 - part) * self._total_s))

    def result(self, so_far: Validation) -> None:
        """Print the result of the last experiment."""
        self._done = len(so_far.results)
        name, result = list(so_far.results.items())[-1]
        self._bar.console.print(result_line(name, result.findings), soft_wrap=True)  # one line, also in a log
        self.step(0.0, "next")


def run(
    spec: PortSpec,
    *,
    names: Sequence[str],
    baseline: Path | None,
    homed: bool,
    faults: Sequence[str],
    view: bool,
    dry_run: bool,
    out: Path | None,
) -> None:
    """Validate the chosen hand, show the result and end the program with its exit code."""
    console = new_console()
    asker = PageAsker(console) if view else TerminalAsker(console)
    with usage_errors():
        if baseline is not None:
            load(baseline)
        spec = with_fields(spec, homed=homed, faults=faults)
        # a hand that does not answer gets a case as well
        opening = open_hand(spec, may_be_silent=not dry_run)
        folder = None if dry_run else _prepared(out, baseline)
        if folder is not None and (folder / "checks.json").exists():
            console.print(f"the results in {folder} are replaced")
    result: Validation | None = None
    with asking(asker, spec) as observer, stops_held():
        try:
            asks = any(EXPERIMENTS[name].asks for name in names)
            # an animated bar would overwrite the questions
            bars = ProgressBar(lines=False, disable=asks)
            with claimed(folder), emptied(folder), let_through_at_entry(opening) as alone, bars as bar:
                opened = replace(alone, onlooker=asker.ask if asks else None)
                observer.follow(source_of(opened))
                chosen = [EXPERIMENTS[name] for name in names or DEFAULT]
                furthest = tuple(np.max([experiment.furthest for experiment in chosen], axis=0))
                if dry_run:
                    console.print(readings(opened, furthest))
                if dry_run or opened.guard is not None:
                    asker.announce(
                        motion(furthest, sum(one.hand_s for one in chosen), spec.guard, emulated=spec.in_software)
                    )
                if folder is None:
                    return
                if view and opened.guard is not None and sys.stdin is not None and sys.stdin.isatty():
                    with stops_let_through():
                        asker.ask(Choice("Keep clear: the hand is about to move.", (Option("start", True),)))
                clear_run(folder)
                along = RunProgress(bar, chosen, observer)

                def kept(so_far: Validation) -> None:
                    write_figures(so_far, folder)
                    name, ran = list(so_far.results.items())[-1]
                    observer.note(str(result_line(name, ran.findings)))
                    _show(so_far, observer)
                    along.result(so_far)

                result = run_validation(
                    opened,
                    names or DEFAULT,
                    baseline=baseline,
                    folder=folder,
                    progress=telling(observer, along.step),
                    on_result=kept,
                )
        # found only when the hand is closed; the readings stay valid
        except (FaultNeverFiredError, SafetyStopError) as error:
            if result is None or folder is None:
                raise
            result = replace(result, end=ended_at_closing(result.end, error))
        hand = None if result.header is None else hand_of_case(result.header, spec, baseline)
        if hand is not None:
            result = replace(result, diagnosis=_with_files(result.diagnosis, hand))
        _show(result, observer)
        for line in run_text(result, str(folder / "report.html")):
            console.print(line)
        write_results(result, folder)
        write_case_of(result, folder, hand)
    _end(result, folder)


def _prepared(out: Path | None, baseline: Path | None) -> Path:
    """Return the folder of the run, write-tested; an earlier run there is replaced once the hand is open."""
    if out is None:
        return run_folder(Path("validation"))
    require_no_steps(out)
    return FOLDER.prepared(out, *(() if baseline is None else (baseline,)))


def _with_files(diagnosis: Diagnosis, hand: HandOfCase) -> Diagnosis:
    """Return a diagnosis whose command names the files of the hand."""
    if diagnosis.step is None or diagnosis.case is None:
        return diagnosis
    files = shlex.join(word for pair in hand.options.items() for word in pair)
    command = f"{diagnosis.step.command} {files}".rstrip()
    return replace(diagnosis, step=replace(diagnosis.step, command=command))


def _show(result: Validation, observer: Observer) -> None:
    observer.verdicts(result.tally.passed, [finding.sentence for finding in failed(result.findings)])


def _end(result: Validation, folder: Path) -> NoReturn:
    """End the program with the exit code of the run."""
    if result.end.kind is EndKind.HOST_BUSY:
        raise Ended(result.end.reason, Exit.HOST_BUSY)
    if result.end.error is None:
        sys.exit(Exit.WITHIN_LIMITS if result.passed else Exit.OUT_OF_LIMITS)
    if isinstance(result.end.error, SystemExit):
        echo(f"what was recorded is in {folder}", err=True)
        raise result.end.error
    code, line = ending(result.end.error)
    raise Ended(line, code)
