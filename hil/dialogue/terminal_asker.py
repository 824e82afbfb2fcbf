"""Questions to the user on the terminal."""

import sys
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, TaskID, TaskProgressColumn

from hil.dialogue.asker import Answer, CaseShown, Choice, Motion, Question
from hil.dialogue.printing import echo
from hil.dialogue.terminal import BAR_WIDTH, ProgressBar, description, plain
from hil.dialogue.typed_input import TypedInput
from hil.targets.target import Target


class TerminalAsker:
    """Asker on standard output and input, with a progress bar on standard error."""

    def __init__(self, console: Console) -> None:
        """Print to a console."""
        self._console = console
        self._typed = TypedInput()
        self._shown = 0
        self._bar: tuple[ProgressBar, TaskID] | None = None

    def ask(self, question: Question[Answer]) -> Answer:
        """Ask until a valid answer arrives; what was typed before the question was shown does not count.

        Raises:
            KeyboardInterrupt: at the end of the input, and on Ctrl-C.
        """
        self._print(question.text)
        while True:
            self._typed.settle()
            line = self.read_line(f"{question.legend} " if isinstance(question, Choice) else "")
            try:
                return question.read(line)
            except ValueError as error:
                self.tell(str(error))

    def read_line(self, legend: str) -> str:
        """Return the next line.

        Raises:
            KeyboardInterrupt: at the end of the input, and on Ctrl-C.
        """
        echo(f"{legend}> ", nl=False)
        while (line := self._typed.line()) is None:
            if self._typed.over:
                raise KeyboardInterrupt
        return line

    def show(self, case: CaseShown) -> None:
        """Print new steps, and the next one or the conclusion."""
        for said in case.done[self._shown :]:
            self._print(f"done       {said}")
        self._shown = len(case.done)
        if (step := case.step) is not None:
            minutes = f"{step.minutes:g} minute{'s' if step.minutes != 1 else ''}"
            self._print(f"why        {step.why}")
            self._print(f"next step  {step.do} ({minutes}{f', with {step.tool}' if step.tool else ''})")
        if case.conclusion:
            self._print(case.conclusion, style="bold")
            echo(case.page)

    def announce(self, motion: Motion) -> None:
        """Print the announcement of a motion."""
        self._print(motion.text)

    def progress(self, part: float, doing: str, left_s: float) -> None:
        """Update the bar, which is shown from the first call until the motion ends."""
        if self._bar is None:
            time_left = plain("{task.fields[left]}")
            bar = ProgressBar(description(), BarColumn(bar_width=BAR_WIDTH), TaskProgressColumn(), time_left)
            self._bar = bar, bar.add_task("", total=1.0, left="")
            bar.start()
        bar, task = self._bar
        bar.update(task, completed=part, description=doing, left=f"{left_s:.0f} s of hand time")
        if part >= 1.0:
            self.close()

    def tell(self, text: str) -> None:
        """Print a line."""
        self._print(text)

    def follow(self, target: Target) -> None:
        """Show nothing of an opened hand."""

    def close(self) -> None:
        """Remove the bar, if shown."""
        if self._bar is not None:
            self._bar[0].stop()
            self._bar = None

    def _print(self, text: str, **options: Any) -> None:
        self.close()
        self._console.print(text, **options)
        sys.stdout.flush()
