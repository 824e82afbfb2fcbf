"""`aero-hil run-policy`: a policy on any hand, recorded."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from PIL import Image
from rich.console import Console
from rich.table import Table

from aero.channels import CABLES, Channel
from aero.policy.file import Policy
from aero.policy.running import Ending, RunSettings
from aero.policy.settings import PRESETS, differences
from aero.policy.shipped import DEFAULT, find_policy
from aero.policy.task import ShownAction, furthest_codes
from aero.protocol import MAX_CODE
from aero.safety import Thresholds
from aero.whole_file import whole
from hil.cli.before_moving import before_moving
from hil.cli.exits import Exit, usage_errors
from hil.cli.options import ChosenHand, Finite, Seconds, target
from hil.cli.terminal import ProgressBar
from hil.cli.terminal import console as new_console
from hil.cli.viewing import telling, viewing, with_view
from hil.recordings.output import prepared_file
from hil.recordings.policy_run import PolicyRun, record_policy
from hil.recordings.recorder import Recorder
from hil.targets.target import GroundTruth
from hil.view.sources import source_of
from model.cube_plant import CubePlant, CubeWatch
from model.geometry import Side
from model.pictures import check_drawing, frames
from model.scene import CUBE
from model.units.cable_correction import NONE, TYPICAL, named_correction

FRAMES_PER_S = 10.0
"""Of a film: half the control periods, which is enough to follow and half the file."""
COLOURS = 64
"""Colours of the palette that all its frames share, so that what does not move does not flicker."""
MOST_A = 4.5
"""What a motor draws at the boards' usual torque limit, A (700 units of 6.5 mA); a guard beyond it never acts."""


@click.command("run-policy")
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@target
@click.option("--seconds", type=Seconds(), default=15.0, show_default=True, help="Time under the policy.")
@click.option("--dry-run", is_flag=True, help="Read and act, but write nothing to the hand.")
@click.option(
    "--settings", "preset", type=click.Choice(list(PRESETS)),
    help="Nominal grasp and scales of the paper's training or deployment, instead of the policy's own.",
)  # fmt: skip
@click.option(
    "--late", is_flag=True,
    help="Write each command a period late and show the last action to any policy, as the official ROS 2 node does.",
)  # fmt: skip
@click.option("--wait", type=Seconds(least=0.0), default=1.5, show_default=True, help="Seconds for placing the object.")
@click.option(
    "--correction", "correction_name", metavar="WHOSE",
    help="Whose correction of the cables: `typical` of healthy hands, `none`, or a unit, such as a file of "
    "`aero-hil calibrate`. The hand's own in hands.toml, or `typical`, when left out.",
)  # fmt: skip
@click.option(
    "--max-current", type=Finite(0.0, MOST_A, min_open=True), default=Thresholds.current_a,
    show_default=True, help="Current of a motor at which the hand is stopped, A.",
)  # fmt: skip
@click.option(
    "--film", type=click.Path(dir_okay=False, path_type=Path), help="Draw an emulated hand and its cube, as a GIF."
)
@click.option("--empty", is_flag=True, help="Leave an emulated hand empty.")
@with_view
@click.option("--record", type=click.Path(dir_okay=False, path_type=Path), help="Write everything to this MCAP file.")
def run_policy(
    *,
    policy_name: str,
    hand: ChosenHand,
    seconds: float,
    dry_run: bool,
    preset: str | None,
    late: bool,
    wait: float,
    correction_name: str | None,
    max_current: float,
    film: Path | None,
    empty: bool,
    view: bool,
    record: Path | None,
) -> None:
    """Run POLICY on a hand: slowly to its grasp, a wait for the object, the policy, slowly back.

    POLICY is the shipped one, `steady` (the default), or a file.

    Every hand is guarded, an emulated one too, and ends open. An emulated hand in this process gets the paper's cube.

    Exits with 0 when the time ran out and 1 when something else ended it; docs/commands.md has the other codes.
    """
    console = new_console()
    holds_cube = hand.target == "emulated" and not (dry_run or empty)
    with usage_errors():
        policy = find_policy(policy_name)
        settings = RunSettings(
            seconds=seconds,
            settings=PRESETS[preset] if preset else None,
            wait_s=wait,
            dry=dry_run,
            one_period_late=late,
            shown_action=ShownAction.LAST if late else None,
        )
        whose = correction_name if correction_name is not None else hand.twin or TYPICAL
        found = named_correction(whose, settings.settings or policy.settings)
        settings = replace(settings, correction=tuple(found.tolist()))
        if record is not None:
            prepared_file(record)
        if film is not None:
            _check_film(film, holds_cube=holds_cube)
        thresholds = Thresholds(current_a=max_current)
    _say_settings(console, policy, settings)
    console.print(_correction_line(whose, settings.correction))
    if hand.target == "pty":
        console.print("A hand on a pseudo-terminal holds no cube; `--hil emulated` has one.")
    with viewing(view, hand) as observer:
        with hand.open(guarded=True, thresholds=thresholds, cube=CUBE if holds_cube else None) as opened:
            observer.follow(source_of(opened))
            grasp = settings.settings or policy.settings
            reach = furthest_codes(opened.map, *map(np.array, (grasp.nominal, grasp.scale, settings.correction)))
            moving_s = 0.0 if dry_run else wait + seconds + 2 * settings.approach_s
            furthest = np.zeros(len(Channel)) if dry_run else reach / MAX_CODE
            console.print(before_moving(opened, furthest.tolist(), moving_s))
            recorder = Recorder(opened, "policy", record)
            name = opened.describe()
            truth = opened.find(GroundTruth)
            plant = None if truth is None else truth.plant
            cube = CubeWatch(plant, hand.seed) if isinstance(plant, CubePlant) else None
            with ProgressBar(console=console, transient=True) as bar:
                task = bar.add_task(name, total=1.0)
                try:
                    result = record_policy(
                        opened,
                        recorder,
                        policy,
                        settings,
                        progress=telling(
                            observer,
                            lambda done, doing: bar.update(task, completed=done, description=f"{name}: {doing}"),
                        ),
                        cube=cube,
                        correction=whose,
                    )
                except BaseException:
                    if recorder.begun:
                        recorder.finish(ended=False)
                        if record:
                            click.echo(f"recorded until then in {record}", err=True)
                    raise
            recorder.finish(ended=result.run.ending is Ending.TIME)
        ended = result.run.ending
        observer.note(f"{ended.value} {result.run.reason}".strip(), "info" if ended is Ending.TIME else "error")
        _print(console, result, cube, record, max_current)
    if film is not None and cube is not None and cube.postures:
        _write_film(cube, hand.side, film, (settings.settings or policy.settings).period_s)
        console.print(f"film in {film}")
    sys.exit(Exit.WITHIN_LIMITS if result.run.ending is Ending.TIME else Exit.OUT_OF_LIMITS)


def _check_film(path: Path, *, holds_cube: bool) -> None:
    if not holds_cube:
        raise ValueError("--film draws an emulated hand and its cube; use it with `--hil emulated`")
    if path.suffix != ".gif":
        raise ValueError(f"--film writes a GIF; name the file .gif, not {path.name}")
    prepared_file(path)
    check_drawing("--film")


def _write_film(watch: CubeWatch, side: Side, path: Path, period_s: float) -> None:
    """Draw the postures that were recorded, `period_s` apart, in the time they took, to a GIF file."""
    every = max(1, round(1.0 / (FRAMES_PER_S * period_s)))
    drawn = [Image.fromarray(picture) for picture in frames(np.array(watch.postures)[::every], side)]
    palette = drawn[len(drawn) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in drawn)
    with whole(path) as draft:
        first.save(draft, save_all=True, append_images=others, duration=round(1e3 * every * period_s), loop=0)


def _say_settings(console: Console, policy: Policy, settings: RunSettings) -> None:
    for name, (trained, used) in differences(policy.settings, settings.settings or policy.settings).items():
        if name != "noise":
            console.print(f"{name}: trained {trained}, used {used}")


def _correction_line(whose: str, correction: Sequence[float]) -> str:
    """Return which correction is used, whose it is and how much it is."""
    millimetres = ", ".join(f"{channel.label} {1e3 * correction[channel]:+.1f}" for channel in CABLES)
    meaning = {TYPICAL: "the mean of healthy hands", NONE: "the hand is taken as the map describes it"}
    return f"Correction of the cables: {whose} ({meaning.get(whose, 'that of this unit')}), mm: {millimetres}."


def _print(
    console: Console, result: PolicyRun, cube: CubeWatch | None, record: Path | None, max_current: float
) -> None:
    run = result.run
    late_ms = 1e3 * np.percentile(result.lateness_s or (0.0,), (50, 99, 100))
    table = Table(show_header=False)
    rows = {
        "ended because": run.ending.value,
        "guard": "stopped the hand" if run.ending is Ending.STOPPED else f"nothing beyond {max_current:g} A",
        "control periods": str(run.steps),
        "lateness, ms": "median {:.2f}, 99 % {:.2f}, most {:.2f}".format(*late_ms),
        "periods without a reading": str(run.missing),
        "periods outside the command window": str(run.saturated),
        "periods held back by the speed limit": str(run.limited),
        "peak current, A": f"{run.peak_current_a:.2f} of {max_current:g}",
        "peak temperature, °C": f"{run.peak_temperature_c:.0f}",
    }
    if cube is not None:
        rows["cube turned"] = f"{cube.rotation_rad:.2f} rad in {cube.alive_s:.1f} s, {cube.rate_rad_s:.2f} rad/s"
        rows["cube at the end"] = "lost" if cube.lost else "in the hand"
    for name, text in rows.items():
        table.add_row(name, text)
    console.print(table)
    if run.reason:
        console.print(run.reason)
    if record:
        console.print(f"recorded in {record}")
