"""How far a validation is: one bar over the whole run, in experiments, and each result when it is there."""

from __future__ import annotations

from collections.abc import Sequence

from hil.checks.shared.experiment import Experiment
from hil.cli.terminal import ProgressBar
from hil.report.text import result_line
from hil.verdict.judged_run import Validation


class RunProgress:
    """Follows a validation through its experiments, weighted by the hand time that each takes.

    On a terminal it is a bar; elsewhere a line an experiment on standard error.
    """

    def __init__(self, bar: ProgressBar, experiments: Sequence[Experiment]) -> None:
        """Begin with none done."""
        self._bar, self._experiments = bar, experiments
        self._total_s = sum(experiment.hand_s for experiment in experiments)
        self._done = 0
        self._task = bar.add_task("opening", total=1.0)

    def step(self, done: float, doing: str) -> None:
        """Note the finished part, 0 to 1, of the present experiment."""
        before_s = sum(experiment.hand_s for experiment in self._experiments[: self._done])
        present = self._experiments[min(self._done, len(self._experiments) - 1)]
        words = f"{min(self._done + 1, len(self._experiments))} of {len(self._experiments)}, {present.name}: {doing}"
        self._bar.update(self._task, completed=(before_s + done * present.hand_s) / self._total_s, description=words)

    def result(self, so_far: Validation) -> None:
        """Print what the experiment that has just ended came to."""
        self._done = len(so_far.results)
        name, result = list(so_far.results.items())[-1]
        self._bar.console.print(result_line(name, result.findings))
        self.step(0.0, "next")
