"""The hand at a port, asked at rest: nothing moves and no register changes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from aero import UNSHIFTED, AeroHand, Channel, CommandWindow
from aero.actuation.fingerprint import fits_span
from aero.errors import AeroError
from aero.firmware import DEFAULT_FIRMWARE, FIRMWARE
from aero.protocol import MAX_CODE
from hil.robots.finding import Examined, Subject, Verdict
from hil.targets.boot_text import identify

SPANS = UNSHIFTED.spans_counts()
"""Width of each channel's command window as homing leaves it, (7,) counts, the same for every firmware and side."""
RESTARTED = CommandWindow.for_firmware(DEFAULT_FIRMWARE, "mixed")
"""The windows of firmware 0.2.0 after a restart without homing: the thumb's have another width."""


@dataclass(frozen=True)
class Answers:
    """What a board said."""

    codes: tuple[int, ...]
    """Positions, command order."""
    temperatures_c: tuple[float, ...]
    knows_limits: bool
    knows_calibrate_mid: bool
    boot_text: str


def ask(port: str) -> Answers:
    """Read a hand at rest.

    Raises:
        AeroError: it does not answer, or not as a hand does.
        ConnectionError: the port cannot be opened, or is lost.
        ValueError: an address that pyserial does not know.
    """
    with AeroHand.open_unguarded(port) as hand:
        codes = tuple(hand.read_codes().tolist())
        temperatures = tuple(hand.read_temperatures().tolist())
        return Answers(codes, temperatures, hand.knows_limits(), hand.knows_calibrate_mid(), hand.boot_text)


def check_hand(port: str, held_by: Sequence[str] = ()) -> Iterator[Examined]:
    """Ask a hand, and judge its answers; one that another program holds is left alone."""
    if held_by:
        found, remedy = f"not asked: {port} is open in {', '.join(held_by)}", "end that program first"
        yield Examined("answer", Verdict.WRONG, found, remedy, subject=Subject.LINK, data={"answers": None})
        return
    try:
        answers = ask(port)
    except (AeroError, ConnectionError, ValueError) as error:
        remedy = "look at the lines about the port above; then supply, cable, and whether this is the hand's port"
        yield Examined("answer", Verdict.WRONG, str(error), remedy, subject=Subject.LINK, data={"answers": False})
        return
    yield Examined("answer", Verdict.OK, f"a hand answers at {port}", subject=Subject.LINK, data={"answers": True})
    yield check_firmware(answers)
    yield check_calibration(answers.codes)


def candidates(answers: Answers) -> tuple[str, ...]:
    """Return the firmware versions that answer so; empty when none does."""
    possible = tuple(
        version
        for version, row in FIRMWARE.items()
        if (row.settings is not None, row.calibrate_mid) == (answers.knows_limits, answers.knows_calibrate_mid)
    )
    if printed := identify(answers.boot_text).versions:
        possible = tuple(version for version in possible if version in printed)
    if restarted(answers.codes):
        possible = tuple(version for version in possible if "mixed" in FIRMWARE[version].calibrations)
    return possible


def check_firmware(answers: Answers) -> Examined:
    """Name the versions that the board behaves like; those that answer alike at rest stand together."""
    versions = candidates(answers)
    data = {"versions": list(versions), "knows_limits": answers.knows_limits}
    data["knows_calibrate_mid"] = answers.knows_calibrate_mid
    if not versions:
        found = "it behaves like none of the known versions"
        remedy = "flash a published version, and home the hand"
        return Examined("firmware", Verdict.LOOK, found, remedy, subject=Subject.HAND, data=data)
    found = f"behaves like {' or '.join(versions)}"
    remedy = "give the flashed one as --firmware; these answer alike, and no board reports its own" * (
        len(versions) > 1
    )
    return Examined("firmware", Verdict.OK, found, remedy, subject=Subject.HAND, data=data)


def restarted(codes: Sequence[int]) -> bool:
    """Return whether the thumb's two windows are those of firmware 0.2.0 or `main` restarted without homing."""
    here, homed = fits_span(codes, RESTARTED.spans_counts()), fits_span(codes, SPANS)
    changed = RESTARTED.spans_counts() != SPANS
    return bool((here & ~homed)[changed].all())


def check_calibration(codes: Sequence[int]) -> Examined:
    """Judge from one reading whether the command windows are those that homing leaves.

    A window of another width shows in nearly every reading; one that is merely moved does not show at all.
    """
    odd = [channel.label for channel in Channel if not fits_span(codes[channel], SPANS[channel])]
    at_end = [channel.label for channel in Channel if codes[channel] in (0, MAX_CODE)]
    data = {"codes": list(codes), "odd": odd, "at_end": at_end, "restarted": restarted(codes)}
    if odd:
        why = "firmware 0.2.0 restarted without homing" if restarted(codes) else "trimmed, or not homed"
        found = f"windows that homing does not leave ({why}): {', '.join(odd)}"
        remedy = "home the hand: free it, then switch its supply off and on, or call home()"
        return Examined("calibration", Verdict.LOOK, found, remedy, subject=Subject.HAND, data=data)
    seen = len(codes) - len(at_end)
    found = f"{seen} of {len(codes)} channels read as after homing"
    if at_end:
        found += f"; at an end, where it does not show: {', '.join(at_end)}"
    remedy = "for this hand's own figures: aero-hil record, then aero-hil calibrate"
    return Examined("calibration", Verdict.OK, found, remedy, subject=Subject.HAND, data=data)
