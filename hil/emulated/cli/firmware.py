"""`aero-hil firmware`: build of a firmware for the emulated hand, and comparison of two."""

import sys
from collections.abc import Iterator
from pathlib import Path

import click

from aero.exit_code import Exit
from aero.side import Side
from firmware_emulator.compare.run import BoardTrace, Contender, compare, contender
from firmware_emulator.compare.sessions import MAKERS, Session, sessions
from firmware_emulator.compare.trace_file import ENDING, Recorded, TraceFileError, read_traces, write_traces
from firmware_emulator.native.build import FirmwareBuildError, build
from firmware_emulator.native.program import FirmwareProgramError
from hil.cli.exits import Ended, usage_errors
from hil.cli.options import SEED
from hil.cli.output_files import PROGRAM, SESSIONS
from hil.dialogue.printing import echo


@click.group()
def firmware() -> None:
    """Run your own firmware on the emulated hand, before flashing anything."""


@firmware.command("build")
@click.argument("source", type=click.Path(exists=True, path_type=Path))
@click.option(
    "--library", type=click.Path(exists=True, file_okay=False, path_type=Path), help="Folder of FTServo_Arduino."
)
@click.option("--out", type=PROGRAM, required=True, help="Program file to write.")
@click.option("--side", type=click.Choice(["right", "left"]), help="Side of the hand; overrides HandConfig.h.")
@click.option("--define", "defines", multiple=True, metavar="NAME[=VALUE]", help="Additional macro; repeatable.")
@click.option(
    "--sanitize", default="", metavar="LIST", help="Sanitizers: address, undefined or both; stop at the first error."
)
def build_command(
    *,
    source: Path,
    library: Path | None,
    out: Path,
    side: str | None,
    defines: tuple[str, ...],
    sanitize: str,
) -> None:
    """Compile the sketch in the folder SOURCE for the emulated board.

    Needs a compiler whose `long` has 32 bits: g++ with its 32-bit libraries, or the extra `firmware`.
    """
    with usage_errors():
        PROGRAM.prepared(out)
    sanitizers = [name.strip() for name in sanitize.split(",") if name.strip()]
    try:
        compiler = build(source, out, library=library, side=side, sanitize=sanitizers, defines=defines)
    except FirmwareBuildError as error:
        raise Ended(str(error), Exit.USAGE) from error
    echo(f"{out} made with {compiler.command[-1] if len(compiler.command) == 1 else 'zig c++'}")
    if compiler.long_bits != 32:
        echo("Its `long` has 64 bits, so positions do not wrap as on the chip; use it to find errors, not to compare.")


@firmware.command("compare")
@click.argument("first")
@click.argument("second")
@click.option("--side", type=click.Choice(["right", "left"]), default="right", show_default=True, help="Side of both.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of the sessions.")
@click.option("--only", multiple=True, type=click.Choice(list(MAKERS)), help="Run only these sessions; repeatable.")
@click.option("--write", type=SESSIONS, help="Record the output of SECOND in a file NAME.jsonl.xz.")
def compare_command(
    *,
    first: str,
    second: str,
    side: Side,
    seed: int,
    only: tuple[str, ...],
    write: Path | None,
) -> None:
    """Run equal sessions on FIRST and SECOND, and show the first difference of each session.

    FIRST and SECOND are each a program of `firmware build` or an emulated version such as 0.2.0. SECOND may also be a
    file of sessions recorded with `--write`, which FIRST then repeats. The comparison covers all bytes to the host,
    the servos and the storage, and their times. Exit code 1: any difference.
    """
    frames = packets = differing = 0
    seconds = 0.0
    kept: list[Recorded] = []
    with usage_errors():
        if write is not None:
            if not write.name.endswith(ENDING):
                raise ValueError(f"--write {write}: name the file *{ENDING}")
            SESSIONS.prepared(write)
        one = contender(first, side)
        rounds = (
            _recorded_rounds(Path(second), only)
            if second.endswith(ENDING)
            else _seeded_rounds(contender(second, side), seed, only)
        )
    try:
        for name, kind, session, other in rounds:
            try:
                outcome = compare(session, one, other)
            except FirmwareProgramError as error:
                raise Ended(f"{name}: {error}", Exit.FIRMWARE) from error
            frames, packets = frames + session.frames, packets + outcome.packets
            seconds += outcome.hand_seconds
            if write is not None:
                kept.append(Recorded(kind, session, outcome.second))
            if outcome.difference is not None:
                differing += 1
                echo("\n".join([f"{name}:", *outcome.difference.lines((first, second))]))
    except TraceFileError as error:
        raise Ended(str(error), Exit.USAGE) from error
    if write is not None:
        write_traces(write, kept)
    verdict = f"{differing} sessions differ" if differing else "no difference"
    echo(f"{verdict}: {frames} frames, {packets} servo packets, {seconds:.0f} s of hand time")
    sys.exit(1 if differing else 0)


Round = tuple[str, str, Session, Contender | BoardTrace]
"""Display name, kind, session, and the second contender or its recorded trace."""


def _recorded_rounds(path: Path, only: tuple[str, ...]) -> Iterator[Round]:
    for recorded in read_traces(path):
        if not only or recorded.kind in only:
            yield recorded.session.name, recorded.kind, recorded.session, recorded.trace


def _seeded_rounds(other: Contender, seed: int, only: tuple[str, ...]) -> Iterator[Round]:
    for kind in only or MAKERS:
        for session in sessions(kind, seed):
            yield f"seed {seed}, {session.name}", kind, session, other
