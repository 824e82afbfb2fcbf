"""`aero-hil record`: excite a hand and record what calibration needs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

import click
from rich.console import Console
from rich.progress import Progress

from aero.channels import Channel
from aero.safety import SafetyStopError
from hil.cli.before_moving import before_moving
from hil.cli.options import target
from hil.recordings.mcap_file import write_recording
from hil.system_identification.excitation import MOTIONS, REACH, excitation
from hil.system_identification.play_excitation import record
from hil.targets.opening import open_target
from hil.targets.target import NoHandError

LABELS = tuple(channel.label for channel in Channel)


@click.command("record")
@target
@click.option("--excite", type=click.Choice([*MOTIONS, "all"]), default="all", show_default=True, help="What to play.")
@click.option("--scale", type=float, default=0.5, show_default=True, help="Share of the safe reach, up to 1.")
@click.option("--channel", "channels", multiple=True, type=click.Choice(LABELS), help="Only this one; repeatable.")
@click.option("--dry-run", is_flag=True, help="Read the hand, show what would move, and stop there.")
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), default=Path("excitation.mcap"), show_default=True,
    help="Recording to write.",
)  # fmt: skip
def record_command(
    *,
    target_name: str,
    firmware: str,
    hand: Literal["right", "left"],
    unit: str,
    seed: int,
    excite: str,
    scale: float,
    channels: tuple[str, ...],
    dry_run: bool,
    out: Path,
) -> None:
    """Excite a free hand with steps, ramps and chirps and record it for `aero-hil calibrate`.

    One channel moves at a time. Nothing may be in reach of the fingers. A hand on a port is guarded: it is opened
    slowly, and the exit code is 1, at a current, a temperature, stale readings or an encoder beyond the thresholds
    shown. Exits with 2 on bad usage or without a hand.
    """
    console = Console()
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        plan = excitation(excite, scale=scale, channels=tuple(Channel[label.upper()] for label in channels or LABELS))
        with open_target(target_name, firmware=firmware, hand=hand, unit=unit, seed=seed) as opened:
            console.print(before_moving(opened, tuple(plan.fractions.max(axis=0))))
            console.print(f"{plan.duration_s:.0f} s of hand time; safe are {[*REACH.values()]} of each window")
            if dry_run:
                return
            with Progress(console=console, transient=True) as bar:
                task = bar.add_task(plan.name, total=1.0)
                recording = record(opened, plan, progress=lambda done, _doing: bar.update(task, completed=done))
        write_recording(recording, out)
    except (NoHandError, ValueError, OSError) as error:
        raise click.UsageError(str(error)) from error
    except SafetyStopError as error:
        raise click.ClickException(str(error)) from error
    console.print(f"{out}: {plan.duration_s:.0f} s")
    errors = [event.text for event in recording.events if event.severity == "error"]
    for text in errors:
        console.print(f"[bold]{text}[/bold]", highlight=False)
    sys.exit(1 if errors else 0)
