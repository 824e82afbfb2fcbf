"""What is said of a run that failed: where, which causes the evidence leaves, and a physical test that splits them."""

from __future__ import annotations

import shlex
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cache
from importlib import resources
from pathlib import Path

from aero.channels import WIRE_ORDER, Channel
from aero.firmware import DEFAULT_FIRMWARE
from hil.checks.shared.declaration import Effect
from hil.checks.shared.subjects import subject_words
from hil.recordings.recording import Header
from hil.targets.target import PHYSICAL
from hil.verdict.findings import Finding

VALIDATE = "aero-hil validate"

ELSEWHERE = {Effect.RESTART, Effect.DRIVER, Effect.HEAT}
"""Effects that no servo, cable or digit has."""


class Component(Enum):
    """A part in which something may be wrong; the values are for people, inside a sentence."""

    CHANNEL = "one channel: its servo, its cable and its digit"
    CHANNELS = "two channels"
    HAND = "whole hand"
    SUPPLY = "power supply"
    BOARD = "board and its firmware"
    LINK = "link between computer, board and servos"
    BOARD_OR_LINK = "board, or its link to the computer"
    """A board that answers nothing more does not say which."""
    DRIVER = "driver or map"
    HOST = "this computer"
    UNKNOWN = "not told"


@dataclass(frozen=True)
class Location:
    """Where something is wrong."""

    component: Component
    channels: tuple[Channel, ...] = ()
    """The channel of `Component.CHANNEL`, or those that are exchanged; empty for the others."""

    @property
    def channel(self) -> Channel | None:
        """The channel, None where it is not one."""
        return self.channels[0] if len(self.channels) == 1 else None

    @property
    def words(self) -> str:
        """The location inside a sentence: `ring finger`, `power supply`."""
        if not self.channels:
            return self.component.value
        *first, last = (subject_words(channel.label) for channel in self.channels)
        return f"{', '.join(first)} and {last}" if first else last


@dataclass(frozen=True)
class Indication:
    """A failed finding, and the effects that it is a witness of."""

    finding: Finding
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class NextStep:
    """One thing to do."""

    do: str
    command: str = ""
    """As a shell takes it; empty for a test without one."""


@dataclass(frozen=True)
class Diagnosis:
    """What the failed findings of a run say together."""

    location: Location | None = None
    """None when nothing failed, or nothing that tells about a place."""
    name: str = ""
    """Row of `diagnoses.toml`; empty when nothing known explains the run."""
    causes: tuple[str, ...] = ()
    """One to three, none likelier than another; none when nothing known explains the run."""
    evidence: tuple[Indication, ...] = ()
    """Failed findings that speak for the causes."""
    unexplained: tuple[Finding, ...] = ()
    """The other failed findings."""
    step: NextStep | None = None
    """A physical test that splits the causes, or what else to do; None when nothing failed."""

    @property
    def unknown(self) -> bool:
        """Whether something is wrong that no rule explains."""
        return self.location is not None and not self.name

    @property
    def sentence(self) -> str:
        """The causes in one sentence."""
        if not self.causes:
            return "Nothing known explains this." if self.unknown else ""
        *first, last = self.causes
        text = f"{', '.join(first)} or {last}" if first else last
        return f"{text[0].upper()}{text[1:]}."


NOTHING = Diagnosis()
"""Of a run in which nothing is wrong."""


@dataclass(frozen=True)
class Row:
    """A row of `diagnoses.toml`."""

    causes: tuple[str, ...] = ()
    test: str = ""
    command: str = ""
    effects: frozenset[Effect] = frozenset()


@cache
def rows() -> Mapping[str, Row]:
    """Return the diagnoses, by name."""
    text = (resources.files("hil") / "data" / "diagnoses.toml").read_text(encoding="utf-8")
    return {
        name: Row(tuple(row["causes"]), row["test"], row.get("command", ""), _effects(row.get("effects")))
        for name, row in tomllib.loads(text).items()
    }


def _effects(names: Iterable[str] | None) -> frozenset[Effect]:
    return frozenset(Effect) - ELSEWHERE if names is None else frozenset(map(Effect, names))


def filled(text: str, location: Location | None, header: Header) -> str:
    """Return the text of a test for the place and the hand it is about: `{where}`, `{hand}`, `{port}`, `{servo}`."""
    channel = location.channel if location else None
    return text.format(
        where="hand" if location is None or not location.channels else location.words,
        hand=hand_options(header),
        port=header.target if header.unit == PHYSICAL else "PORT",
        servo="SERVO" if channel is None else WIRE_ORDER.index(channel),
    )


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


def on_hand(text: str, header: Header) -> str:
    """Return a text whose commands name the hand of a recording."""
    return text.replace(f"`{VALIDATE}", f"`{VALIDATE}{hand_options(header)}")


def command_again(header: Header) -> str:
    """Return the command that made a recording, without the path of its program."""
    program, _, rest = header.command.partition(" ")
    return f"{Path(program).name} {rest}" if header.command else f"{VALIDATE}{hand_options(header)}"
