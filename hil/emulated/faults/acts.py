"""Acts on a running emulated hand, by name: typed, clicked, or called from Python."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from firmware_emulator.held_signals import HeldSignals
from hil.emulated.faults.catalogue import channel_named, named, parse_fault
from hil.emulated.faults.workbench import Workbench
from hil.verdict.part import Part

PARTS = {part.name.lower(): part for part in Part}
READS: dict[str, Callable[[str], object]] = {
    "FAULT": parse_fault,
    "CHANNEL": channel_named,
    "PART": lambda name: named("part", name, PARTS),
}
"""Parsers of an act's arguments, by kind."""


@dataclass(frozen=True)
class HandAct:
    """User's act on a hand."""

    takes: tuple[str, ...]
    """Argument kinds, keys of `READS`; optional ones in brackets."""
    words: str
    do: Callable[..., object]
    """Performs the act, given the workbench and the parsed arguments."""


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
    "supply_off": HandAct((), "switch off the servos' supply, USB stays", Workbench.supply_off),
    "supply_on": HandAct((), "switch on the servos' supply, USB stays", Workbench.supply_on),
    "replace": HandAct(("PART", "[CHANNEL]"), "replace a part", Workbench.replace),
    "feel": HandAct(("CHANNEL",), "bend a digit, supply off", Workbench.feel),
    "look": HandAct(("CHANNEL",), "look along a cable", Workbench.look),
    "registers": HandAct((), "read the servos on a bus adapter", Workbench.registers),
    "flash": HandAct((), "flash the declared firmware", Workbench.flash),
    "flashed": HandAct((), "look which firmware is on the board", Workbench.flashed),
    "voltage": HandAct((), "measure the supply", Workbench.voltage),
}
"""All acts by name. Each act returns at once."""


def act(workbench: Workbench, text: str) -> str:
    """Perform an act given as text, such as `inject motor_dead:ring` or `exchange_servos ring pinky`.

    Raises:
        ValueError: unknown act, wrong arguments, or an act that the hand refuses; the line names the valid ones.
    """
    name, *words = text.split() or [""]
    chosen = named("act", name, ACTS)
    least = sum(not one.startswith("[") for one in chosen.takes)
    if not least <= len(words) <= len(chosen.takes):
        raise ValueError(f"usage: {' '.join((name, *chosen.takes))}, not {text!r}")
    taken: list[Any] = [READS[kind.strip("[]")](word) for kind, word in zip(chosen.takes, words, strict=False)]
    held = HeldSignals()  # half an act would be in no state that another one undoes
    try:
        held.hold()
        chosen.do(workbench, *taken)
    except ValueError:  # refused
        raise
    except BaseException:
        workbench.electronics.kernel.left = True
        raise
    finally:
        held.release()
    return workbench.done[-1][1]
