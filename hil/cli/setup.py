"""`aero-hil setup`: first steps with a new hand, from its port to its name in hands.toml."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path

import click
from serial.tools.list_ports import comports

from aero.channels import Channel
from aero.errors import AeroError, NoTelemetryError
from aero.firmware import FIRMWARE, VERSION_GROUPS
from aero.safety import SafetyStopError
from aero.side import Side
from hil.checks import EXPERIMENTS, Measured
from hil.checks.look.check import AGAIN, NUDGE, which_moved
from hil.checks.shared.subjects import subject_words
from hil.cli.doctor.ports import HAND_USB, Answers, ask, candidates, holders
from hil.cli.exits import usage_errors
from hil.cli.options import VIEW
from hil.dialogue.asker import Asker, Choice, FreeText, Option
from hil.dialogue.before_moving import motion
from hil.dialogue.page_asker import PageAsker
from hil.dialogue.terminal import console
from hil.dialogue.terminal_asker import TerminalAsker
from hil.dialogue.viewing import asking
from hil.targets.hand_spec import HOMINGS, PortSpec, named_port
from hil.targets.hands_file import FILE, add_hand, refuse_taken
from hil.targets.opening import open_spec
from hil.targets.target import Target
from hil.verdict.limits import excesses, load_limits, out_of_limits
from hil.verdict.rerun import nudge
from hil.verdict.validation import validate
from hil.view.sources import source_of

SLOW_HOMING_S = 45.0
"""Homing time that separates the versions, s: the newer ones take 42.6 s if every search times out, the others 57 s."""
TELLING = ("presence", "excursion", "coupling", "response")
"""Experiments whose readings differ between versions."""
UNPLUG = "Unplug the USB cable of the hand from this computer."
PLUG = "Plug it in again, and switch the hand's supply on."
SIDE = "Look at the palm, fingers up. On which side is the thumb?"
CLEAR = (
    "Take everything out of the hand, and keep fingers, cables and clothes clear of it. Homing drives each digit into "
    "its stop, {homings} times, in 5 s to a minute each. Only the switch of the supply stops a homing."
)
CLOSES = "The versions {versions} remain. Their motions differ."
WHICH = "Which version was flashed? It is in the name of the file, such as firmware_v0.1.4_righthand.bin."
DONE = (Option("done", True),)
SIDES: tuple[Option[Side], ...] = (Option("right", "right", "r"), Option("left", "left", "l"))
Opener = Callable[[PortSpec], AbstractContextManager[Target]]


@click.command()
@click.option("--hil", "port", metavar="PORT", help="Port of the hand; without it, the port is found by unplugging it.")
@VIEW
def setup(*, port: str | None, view: bool) -> None:
    """Set up a new hand: port, side, firmware, homing, a first motion of each channel, and its name in hands.toml.

    Takes up to ten minutes. Each motion is announced and waits for an answer. Ctrl-C opens the hand and ends the setup;
    the file is written at its end. The page of --view opens once port and side are known.
    """
    asker = PageAsker(console()) if view else TerminalAsker(console())
    try:
        with usage_errors():
            if not os.access(".", os.W_OK):
                raise ValueError(f"{FILE} is written to the working folder, which is read-only; start in another one")
            if Path(FILE).exists():
                refuse_taken("new-hand-to-be-named")
            if port is not None:
                port = named_port(port).port
        set_up(asker, port)
    except BaseException as error:
        asker.close()
        if isinstance(error, KeyboardInterrupt):
            asker.tell(f"interrupted: {FILE} is unchanged, and the same command begins again")
        raise


def set_up(asker: Asker, port: str | None, open_one: Opener = open_spec) -> None:
    """Guide a person through the first steps.

    Raises:
        SafetyStopError: the guard stopped the hand, or refused to move it; it is named nevertheless.
        AeroError, NoHandError: the hand does not answer any more.
    """
    name = _name(asker)
    port = port or _port(asker)
    versions = candidates(_answers(asker, port)) or tuple(FIRMWARE)
    asker.tell(f"a hand answers at {port}; it behaves like firmware {' or '.join(versions)}")
    spec = PortSpec(port, versions[-1], asker.ask(Choice(SIDE, SIDES)))
    with asking(asker, spec, title=f"New {spec.side} hand at {port}") as page:

        @contextmanager
        def seen(spec: PortSpec) -> Iterator[Target]:
            with open_one(spec) as target:
                page.follow(source_of(target))
                yield target

        odd: list[str] = []
        stop: SafetyStopError | None = None
        try:
            versions, odd = _moved(asker, spec, versions, seen)
        except SafetyStopError as error:  # a faulty hand needs its name, too: its validation finds the part
            stop = error
            asker.tell("The hand was stopped; its first motions end here.")
        if len(versions) > 1:
            options = (*(Option(one, one) for one in versions), Option(f"not sure: {versions[-1]}", versions[-1], "u"))
            versions = (asker.ask(Choice(WHICH, options)),)
        add_hand(name, _by_id(port), versions, side=spec.side)
        asker.tell(f"{name} is in {FILE}: {spec.side} hand, firmware {versions[0]}")
        for line in odd:
            asker.tell(line)
        asker.tell(f"next: aero-hil validate --hil {name}")
    if stop is not None:
        raise stop


def _moved(
    asker: Asker, spec: PortSpec, versions: tuple[str, ...], open_one: Opener
) -> tuple[tuple[str, ...], list[str]]:
    """Home and move the hand; return the versions that it moves like, and a line for each odd motion."""
    slow = _homed(asker, spec, open_one)
    versions = tuple(one for one in versions if (FIRMWARE[one].homing_s > SLOW_HOMING_S) == slow) or versions
    spec = replace(spec, firmware=versions[-1])
    with open_one(spec) as target:
        odd = _nudged(asker, target, spec)
        if len(alike := _groups(versions)) > 1 and not odd:
            versions = _told(asker, target, spec, alike)
    return versions, odd


def _name(asker: Asker) -> str:
    while True:
        name = asker.ask(FreeText("Name of this hand, such as bench-left:"))
        try:
            refuse_taken(name)
        except ValueError as error:
            asker.tell(str(error))
        else:
            return name


def _port(asker: Asker) -> str:
    """Return the only port of a hand's board, or the one that a person unplugs and plugs in again."""
    boards = [one.device for one in comports() if (one.vid, one.pid) == HAND_USB]
    if len(boards) == 1:
        return str(boards[0])
    while True:
        asker.ask(Choice(UNPLUG, DONE))
        before = {one.device for one in comports()}
        asker.ask(Choice(PLUG, DONE))
        new = sorted({one.device for one in comports()} - before)
        if len(new) == 1:
            return str(new[0])
        asker.tell(f"{len(new)} ports have appeared, not one; the cable may carry power only")


def _answers(asker: Asker, port: str) -> Answers:
    """Query the hand until it answers; nothing moves."""
    while True:
        try:
            if held := holders(port):
                raise ConnectionError(f"{port} is open in {', '.join(held)}; end it first")
            return ask(port)
        except NoTelemetryError:
            asker.tell(
                "The board answers over USB, but its servos do not: switch the supply on, and look at its plugs."
            )
        except (AeroError, ConnectionError, ValueError) as error:
            asker.tell(str(error))
        asker.ask(
            Choice("A board that homes after power-on answers after a minute. Try again?", (Option("again", True),))
        )


def _homed(asker: Asker, spec: PortSpec, open_one: Opener) -> bool:
    """Home the hand; return whether its last homing was slow."""
    asker.ask(Choice(CLEAR.format(homings=HOMINGS), (Option("home", True),)))
    took_s = 0.0
    with open_one(spec) as target:
        for number in range(HOMINGS):
            asker.progress(number / HOMINGS, f"homing {number + 1} of {HOMINGS}", 60.0 * (HOMINGS - number))
            start = target.clock.now()
            target.hand.home()
            took_s = target.clock.now() - start
    asker.progress(1.0, "homed", 0.0)
    asker.tell(f"homed in {took_s:.0f} s")
    return took_s > SLOW_HOMING_S


def _nudged(asker: Asker, target: Target, spec: PortSpec) -> list[str]:
    """Move each channel a little; return a line for each that moved another digit, or none."""
    asker.announce(motion([NUDGE[channel] for channel in Channel], 30.0, spec.guard))
    asker.ask(Choice("Each channel moves a little, one after the other. Watch the hand.", (Option("start", True),)))
    odd = []
    for channel in Channel:
        moved = AGAIN
        while moved == AGAIN:
            nudge(target, channel)
            moved = asker.ask(which_moved(channel.label))
        if moved != channel.label:
            seen = (
                "moved nothing" if moved not in {one.label for one in Channel} else f"moved the {subject_words(moved)}"
            )
            odd.append(f"The command of the {subject_words(channel.label)} {seen}; the validation begins a case of it.")
    return odd


def _groups(versions: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the versions by groups that move alike."""
    found = (tuple(one for one in group if one in versions) for group in VERSION_GROUPS)
    return [group for group in found if group]


def _told(asker: Asker, target: Target, spec: PortSpec, groups: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Return the versions that the hand moves like; all of them if its motion tells none."""
    chosen = [EXPERIMENTS[name] for name in TELLING]
    furthest = [max(one.furthest[channel] for one in chosen) for channel in Channel]
    hand_s = sum(one.hand_s for one in chosen)
    asker.announce(motion(furthest, hand_s, spec.guard))
    asker.ask(Choice(CLOSES.format(versions=", ".join(sum(groups, ()))), (Option("start", True),)))
    run = validate(target, TELLING, progress=lambda done, doing: asker.progress(done, doing, (1.0 - done) * hand_s))
    asker.progress(1.0, "done", 0.0)
    if isinstance(run.end.error, KeyboardInterrupt | SystemExit):
        raise run.end.error
    if run.end.error is not None:
        asker.tell(str(run.end.error))
    fits = [one for one in groups if _fits(run.numbers, one[0])]
    return sum(fits or groups, ())


def _fits(numbers: Mapping[str, Measured], version: str) -> bool:
    """Return whether all readings are those of healthy hands with a version."""
    return not any(map(out_of_limits, excesses(numbers, load_limits(version, guarded=True)).values()))


def _by_id(port: str) -> str:
    """Return the path of a port that stays when others are plugged in, if the system has one."""
    real = os.path.realpath(port)
    links = (str(one) for one in Path("/dev/serial/by-id").glob("*") if os.path.realpath(one) == real)
    return next(links, port)
