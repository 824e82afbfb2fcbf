"""Acts on a running emulated hand, by name: the words that are typed, clicked or given in Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from hil.faults.catalogue import channel_named, named, parse_fault
from hil.faults.fault import Part
from hil.faults.workbench import Workbench

PARTS = {part.name.lower(): part for part in Part}
READS: dict[str, Callable[[str], object]] = {
    "FAULT": parse_fault,
    "CHANNEL": channel_named,
    "PART": lambda name: named("part", name, PARTS),
}
"""What may follow the name of an act, and how it is read."""


@dataclass(frozen=True)
class HandAct:
    """Something that a person does to a hand."""

    takes: tuple[str, ...]
    """What follows the name: keys of `READS`; in brackets what may be left out."""
    words: str
    """What it is, for people."""
    do: Callable[..., object]
    """Does it, given the workbench and what was taken; returns what is seen."""


ACTS: dict[str, HandAct] = {
    "inject": HandAct(("FAULT",), "break it", Workbench.inject),
    "clear": HandAct(("FAULT",), "take a fault away", Workbench.clear),
    "exchange_servos": HandAct(("CHANNEL", "CHANNEL"), "exchange two servos", Workbench.exchange_servos),
    "exchange_plugs": HandAct(("CHANNEL", "CHANNEL"), "exchange two servos' bus plugs", Workbench.exchange_plugs),
    "cable_off": HandAct(("CHANNEL",), "take a cable off its spool", Workbench.cable_off),
    "cable_on": HandAct(("CHANNEL",), "put it on again", Workbench.cable_on),
    "hold": HandAct((), "put something into the hand", Workbench.hold),
    "let_go": HandAct((), "empty the hand, nothing touching", Workbench.let_go),
    "home": HandAct((), "home", Workbench.home),
    "power_off": HandAct((), "switch off", Workbench.power_off),
    "power_on": HandAct((), "switch on", Workbench.power_on),
    "replace": HandAct(("PART", "[CHANNEL]"), "replace a part", Workbench.replace),
    "bend": HandAct(("CHANNEL",), "bend a digit by hand", Workbench.bend),
    "turn": HandAct(("CHANNEL",), "turn a spool by hand, its torque off", Workbench.turn),
    "feel": HandAct(("CHANNEL",), "bend a digit, supply off", Workbench.feel),
    "look": HandAct(("CHANNEL",), "look along a cable", Workbench.look),
    "registers": HandAct((), "read the servos on a bus adapter", Workbench.registers),
    "flash": HandAct((), "flash the declared firmware", Workbench.flash),
    "flashed": HandAct((), "look which firmware is on the board", Workbench.flashed),
    "voltage": HandAct((), "measure the supply", Workbench.voltage),
}
"""What may be done. Every one of them happens at once, and what takes time goes on while the hand runs."""


def act(workbench: Workbench, text: str) -> str:
    """Do what a line of words says, as in `inject motor_dead:ring` or `exchange_servos ring pinky`.

    Raises:
        ValueError: there is no such act, it takes other words, or it cannot be done; one line says what can.
    """
    name, *words = text.split() or [""]
    chosen = named("act", name, ACTS)
    least = sum(not one.startswith("[") for one in chosen.takes)
    if not least <= len(words) <= len(chosen.takes):
        raise ValueError(f"it is written {' '.join((name, *chosen.takes))}, not {text!r}")
    taken: list[Any] = [READS[kind.strip("[]")](word) for kind, word in zip(chosen.takes, words, strict=False)]
    chosen.do(workbench, *taken)
    return workbench.done[-1][1]
