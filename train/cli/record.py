"""`aero-hil record`: excitation of a hand, recorded for calibration."""

from pathlib import Path

import click

from aero.channels import Channel
from hil.cli.exits import usage_errors
from hil.cli.options import Finite, open_hand, target
from hil.cli.output_files import RECORDED
from hil.dialogue.before_moving import before_moving, readings
from hil.dialogue.printing import echo
from hil.dialogue.terminal import ProgressBar
from hil.dialogue.terminal import console as new_console
from hil.recordings.recorder import Recorder
from hil.targets.hand_spec import PortSpec
from train.identification.excitation import EXPERIMENT, MOTIONS, REACH, excitation, play

LABELS = tuple(channel.label for channel in Channel)


@click.command("record")
@target
@click.option(
    "--excite", type=click.Choice([*MOTIONS, "all"]), default="all", show_default=True, help="Motion to record."
)
@click.option(
    "--scale",
    type=Finite(0.0, 1.0, min_open=True),
    default=0.5,
    show_default=True,
    help="Fraction of the safe reach.",
)
@click.option("--channel", "channels", multiple=True, type=click.Choice(LABELS), help="Moved channel; repeatable.")
@click.option("--dry-run", is_flag=True, help="Read the hand, print the planned motion, and stop.")
@click.option(
    "--out", type=RECORDED, default=Path("excitation.mcap"), show_default=True,
    help="Recording to write.",
)  # fmt: skip
def record_command(
    *,
    spec: PortSpec,
    excite: str,
    scale: float,
    channels: tuple[str, ...],
    dry_run: bool,
    out: Path,
) -> None:
    """Excite a free hand with steps, ramps and chirps and record it for `aero-hil calibrate`.

    The fingers move together, each thumb channel alone, with nothing in their reach. The guard opens a hand on a port
    slowly, with exit code 4, if a current, a temperature, an encoder or the age of the readings exceeds its printed
    threshold. An interruption keeps the recording so far.
    """
    console = new_console()
    with usage_errors():
        plan = excitation(excite, scale=scale, channels=tuple(Channel[label.upper()] for label in channels or LABELS))
        RECORDED.prepared(out)
    with open_hand(spec) as opened:
        furthest = tuple(plan.fractions.max(axis=0))
        if dry_run:
            console.print(readings(opened, furthest))
        console.print(before_moving(opened, furthest, plan.duration_s).text)
        reach = ", ".join(f"{channel.label} {100 * REACH[channel]:.0f} %" for channel in Channel)
        console.print(f"{plan.duration_s:.0f} s of hand time; the safe reach of each window: {reach}")
        if dry_run:
            return
        recorder = Recorder(opened, EXPERIMENT, out)
        try:
            with ProgressBar() as bar:
                task = bar.add_task(plan.name, total=1.0)
                play(opened, recorder, plan, progress=lambda done, _doing: bar.update(task, completed=done))
        except BaseException:
            if recorder.begun:
                recording = recorder.finish(ended=False)
                echo(f"{out}: {recording.header.duration_s:.0f} of {plan.duration_s:.0f} s were recorded", err=True)
            raise
        recording = recorder.finish()
    console.print(f"{out}: {recording.header.duration_s:.0f} s")
