"""The person at the terminal, who looks at the hand and answers."""

from __future__ import annotations

import click

from hil.targets.onlooker import Question


def ask_on_terminal(question: Question) -> str:
    """Ask until there is an answer that fits.

    Raises:
        KeyboardInterrupt: at the end of the input, and on Ctrl-C.
    """
    click.echo(question.text)
    try:
        answer = click.prompt(question.legend, type=click.Choice(list(question.answers)), show_choices=False)
    except click.Abort as error:
        raise KeyboardInterrupt from error
    return question.answers[answer]
