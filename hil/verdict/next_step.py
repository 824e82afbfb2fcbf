"""The one thing to do after a run that failed."""

from __future__ import annotations

import shlex
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

from aero.channels import WIRE_ORDER, Channel
from aero.firmware import DEFAULT_FIRMWARE
from hil.checks import EXPERIMENTS, JUDGED
from hil.checks.shared.subjects import subject_words
from hil.recordings.recording import Header
from hil.targets.target import PHYSICAL
from hil.verdict.explanation import Explanation

FILE = "next_steps.toml"
VALIDATE = "aero-hil validate"


@dataclass(frozen=True)
class Advised:
    """What is known about a cause, for people: a row of `next_steps.toml`."""

    name: str
    do: str
    command: str = ""


@dataclass(frozen=True)
class NextStep:
    """One thing to do: a look at a named place, a command, or a look with the command that helps."""

    do: str
    command: str = ""
    """As a shell takes it; empty for a look without one."""


@cache
def advised() -> Mapping[str, Advised]:
    """Return what is known about each cause, for people."""
    text = (resources.files("hil") / "data" / FILE).read_text(encoding="utf-8")
    return {cause: Advised(**row) for cause, row in tomllib.loads(text).items()}


def cause_words(cause: str) -> str:
    """Return the name of a cause for people."""
    known = advised().get(cause)
    return known.name if known else cause.replace("_", " ")


def hand_options(header: Header) -> str:
    """Return the options of `aero-hil` that choose the hand of a recording, each after a blank."""
    options: list[str] = []
    if header.target != "emulated":
        options += ["--hil", header.target]
    if header.firmware != DEFAULT_FIRMWARE:
        options += ["--firmware", header.firmware]
    if header.hand != "right":
        options += ["--hand", header.hand]
    if header.unit not in (PHYSICAL, "reference"):
        options += ["--unit", header.unit]
    if header.unit != PHYSICAL and header.seed:
        options += ["--seed", str(header.seed)]
    for fault in header.faults.split():
        options += ["--fault", fault]
    return "".join(f" {shlex.quote(option)}" for option in options)


def step_for(explanation: Explanation, header: Header) -> NextStep | None:
    """Return what to do about a cause, None when nothing is known about it."""
    known = advised().get(explanation.cause)
    if known is None:
        return None
    channel = explanation.channel
    filled = {
        "where": "hand" if channel is None else subject_words(channel.label),
        "hand": hand_options(header),
        "port": header.target if header.unit == PHYSICAL else "PORT",
        "servo": "SERVO" if channel is None else str(servo_id(channel)),
    }
    return NextStep(known.do.format(**filled), known.command.format(**filled))


def only(experiment: str) -> str:
    """Return the command that runs one experiment; the whole run where it is measured on that."""
    return f"{VALIDATE} --only {experiment}" if experiment in EXPERIMENTS else VALIDATE


def on_hand(text: str, header: Header) -> str:
    """Return a text whose commands name the hand of a recording."""
    return text.replace(f"`{VALIDATE}", f"`{VALIDATE}{hand_options(header)}")


def metric_words(experiment: str, metric: str) -> str:
    """Return the name of a number for people."""
    metrics = JUDGED[experiment].metrics if experiment in JUDGED else ()
    found = (known.words for known in metrics if known.name == metric)
    return next(found, metric.replace("_", " "))


def command_again(header: Header) -> str:
    """Return the command that made a recording, without the path of its program."""
    program, _, rest = header.command.partition(" ")
    return f"{Path(program).name} {rest}" if header.command else f"{VALIDATE}{hand_options(header)}"


def servo_id(channel: Channel) -> int:
    """Return the ID that the servo of a channel has on the bus: its place on the wire."""
    return WIRE_ORDER.index(channel)
