"""The reference pages that are made from the code: commands, Python, checks and limits.

`mkdocs` runs this file while it builds the site; nothing of it is committed.
"""

from collections.abc import Iterator

import mkdocs_gen_files

import aero.errors
import aero.safety
import hil
from aero.firmware import DEFAULT_FIRMWARE
from hil.checks import JUDGED
from hil.checks.shared.declaration import Metric
from hil.cli.command_table import commands as commands_of_all
from hil.verdict.limits import Limit, load_limits

FIXTURES = ("aero_target", "aero_session_target", "aero_hand", "aero_port")
FIRMWARE = DEFAULT_FIRMWARE
"""Of the limits that are shown: what `aero-hil validate` takes when nothing else is asked for."""


def commands() -> Iterator[str]:
    """Give the page of the commands: each with its options, from click."""
    yield "# Commands and options\n"
    yield "As `aero-hil COMMAND --help` prints them. [Exit codes and files](../commands.md) says how commands end.\n"
    for name, row in commands_of_all().items():
        module, attribute = row.place.split(":")
        yield f"::: mkdocs-click\n    :module: {module}\n    :command: {attribute}\n    :prog_name: aero-hil {name}"
        yield "    :depth: 1\n    :style: plain\n"
        yield f"Needs the extra `{row.extra}`.\n" if name != "doctor" else "Needs no extra.\n"


def api() -> Iterator[str]:
    """Give the page of the public names of `aero` and `hil`."""
    yield "# Python\n"
    errors = [
        name for name, kind in vars(aero.errors).items() if isinstance(kind, type) and kind.__module__ == "aero.errors"
    ]
    for package, names, about in (
        ("aero", aero.__all__, "What drives a hand. It needs NumPy and pyserial only."),
        ("aero.safety", aero.safety.__all__, "The guard."),
        ("aero.errors", errors, "Errors of the driver; each has the exit code of a command that it ends."),
        ("hil", hil.__all__, "Hands of every kind behind one name, emulated or physical."),
        ("aero_hil_pytest", FIXTURES, "Fixtures of pytest."),
    ):
        yield f"## {package}\n\n{about}\n"
        for name in names:
            yield f"::: {package}.{name}\n"


def checks() -> Iterator[str]:
    """Give the page of what each experiment measures, and the limits for a hand as it is shipped."""
    limits = load_limits(FIRMWARE)
    yield "# Checks and limits\n"
    yield f"What each experiment measures, and the limits with firmware {FIRMWARE}, not guarded."
    yield "Every check is named `experiment.metric`, as in `checks.json`. [Campaigns](../results/campaign.md) says"
    yield "where limits come from. A number without a limit is measured and not judged.\n"
    for name, measuring in JUDGED.items():
        yield f"## {name}\n\n{measuring.title}.\n"
        yield "| check | quantity | limits |\n|---|---|---|"
        yield from (_row(name, metric, limits) for metric in measuring.metrics)
        yield ""


def _row(experiment: str, metric: Metric, limits: tuple[Limit, ...]) -> str:
    found = [limit for limit in limits if (limit.experiment, limit.metric) == (experiment, metric.name)]
    bounds = [
        f"{', '.join(subjects)}: {limit.text(metric.unit)}"
        for limit in found
        if (subjects := [subject for subject in limit.subjects if subject in metric.subjects])
    ]
    limited = "<br>".join(bounds) or f"{', '.join(metric.subjects)}: none"
    cells = (f"`{metric.name}`", f"{metric.words}, {metric.unit}", limited)
    return f"| {' | '.join(cell.strip().replace('|', chr(92) + '|') for cell in cells)} |"


for page, lines in (("commands", commands()), ("api", api()), ("checks", checks())):
    with mkdocs_gen_files.open(f"reference/{page}.md", "w") as file:
        file.write("\n".join(lines) + "\n")
