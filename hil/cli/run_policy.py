"""`aero-hil run-policy`: recorded run of a policy on any hand."""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from aero.channels import CABLES, Channel
from aero.exit_code import Exit
from aero.policy.cables import MEASURED, MEASURING_S, REACH, Measurement
from aero.policy.file import Policy
from aero.policy.held import held_at_the_end
from aero.policy.own import ended
from aero.policy.running import Ending, RunSettings
from aero.policy.shipped import DEFAULT, find_policy
from aero.policy.task import furthest_codes
from aero.protocol import MAX_CODE
from hil.cli.exits import usage_errors
from hil.cli.options import LONGEST_S, SECONDS, VIEW, Finite, open_hand, target
from hil.cli.output_files import RECORDED
from hil.dialogue.before_moving import before_moving
from hil.dialogue.printing import echo
from hil.dialogue.terminal import ProgressBar
from hil.dialogue.terminal import console as new_console
from hil.dialogue.viewing import telling, viewing
from hil.emulated.policy_hand import CUBE, NONE, TYPICAL, CubeWatch, cube_of, named_correction
from hil.recordings.policy_run import PolicyRun, cable_text, measured_cables, record_policy
from hil.recordings.recorder import Progress, Recorder
from hil.targets.hand_spec import PortSpec
from hil.targets.target import Target
from hil.view.sources import source_of

CODES = {
    Ending.TIME: Exit.WITHIN_LIMITS,
    Ending.STOPPED: Exit.STOPPED,
    Ending.READINGS: Exit.NO_HAND,
    Ending.OVERRUN: Exit.HOST_BUSY,
    Ending.TOO_SLOW: Exit.HOST_BUSY,
}


@click.command("run-policy")
@click.argument("policy_name", metavar="[POLICY]", default=DEFAULT)
@target
@click.option("--seconds", type=SECONDS, default=15.0, show_default=True, help="Run time of the policy, s.")
@click.option("--dry-run", is_flag=True, help="Run the policy on the readings without commanding the hand.")
@click.option(
    "--wait", type=Finite(0.0, LONGEST_S), default=1.5, show_default=True, help="Time for placing the object, s."
)
@click.option(
    "--correction", "correction_name", metavar="CORRECTION",
    help="Cable-length correction: `measured` on the free hand before the run, `typical` of healthy hands, `none`, or "
    "that of a unit, such as a file of `aero-hil calibrate`. Default: the twin in hands.toml, else `measured`.",
)  # fmt: skip
@click.option("--empty", is_flag=True, help="Run an emulated hand without a cube.")
@VIEW
@click.option("--record", type=RECORDED, help="Record the run to this MCAP file.")
def run_policy(
    *,
    policy_name: str,
    spec: PortSpec,
    seconds: float,
    dry_run: bool,
    wait: float,
    correction_name: str | None,
    empty: bool,
    view: bool,
    record: Path | None,
) -> None:
    """Run POLICY on a hand: measure its cables, ramp to the grasp, wait for the object, run the policy, ramp back.

    POLICY is `steady` (shipped, the default), a policy file, an ONNX file, or package.module:factory in Python. A TOML
    file beside the last two declares observation and action; see "Run your policy" in the documentation.

    The measurement takes 5 s and closes the hand to its stops: give it the object only when asked.

    Every hand is guarded, even an emulated one, and finally opened. An emulated hand in this process gets the paper's
    cube.

    Exit code 0: full time; 3: too many readings missing; 4: stopped by the guard; 7: policy or computer too slow;
    others: see "Exit codes" in the documentation.
    """
    console = new_console()
    holds_cube = spec.port == "emulated" and not (dry_run or empty)
    with usage_errors():
        policy = find_policy(policy_name)
        whose = correction_name if correction_name is not None else spec.twin or MEASURED
        if whose == MEASURED and (dry_run or (spec.thresholds is not None and spec.thresholds.forbidden)):
            console.print("The cables are not measured in a dry run, nor on a hand with forbidden regions.")
            whose = TYPICAL
        named = TYPICAL if whose == MEASURED else whose
        correction = tuple(named_correction(named, policy.settings).tolist())
        settings = RunSettings(seconds=seconds, wait_s=wait, dry=dry_run, correction=correction)
        if record is not None:
            RECORDED.prepared(record)
    if whose != MEASURED:
        console.print(_correction_line(whose, settings.correction))
    if spec.port == "pty":
        console.print("A hand on a pseudo-terminal holds no cube; `--hil emulated` has one.")
    with ended(policy), viewing(view, spec) as observer:
        with open_hand(spec, guarded=True, cube=CUBE if holds_cube else None) as opened:
            observer.follow(source_of(opened))
            console.print(_before_moving(opened, policy, settings, measuring=whose == MEASURED))
            measurement = None
            if whose == MEASURED:
                measurement = _measurement(opened, console)
                settings = replace(settings, correction=measurement.correction)
            most_a = opened.guard.thresholds.current_a if opened.guard else math.inf
            cube = cube_of(opened)
            result = _recorded(
                opened,
                record,
                lambda recorder, show: record_policy(
                    opened,
                    recorder,
                    policy,
                    settings,
                    progress=telling(observer, show),
                    cube=cube,
                    correction=whose,
                    measurement=measurement,
                ),
            )
        end = result.run.ending
        observer.note(f"{end.value} {result.run.reason}".strip(), "info" if end is Ending.TIME else "error")
        ours = policy.name == DEFAULT and not dry_run  # the thresholds were measured with this policy only
        held = held_at_the_end(result.currents_a, policy.settings.period_s).value if ours else ""
        console.print(_outcome(result, held, cube, most_a))
        if result.run.reason:
            console.print(result.run.reason)
        if 2 * result.run.slow > result.run.steps:
            console.print(f"The policy is too slow for its rate: an action has {1e3 * policy.settings.period_s:g} ms.")
        if record:
            console.print(f"recorded in {record}")
    sys.exit(CODES[result.run.ending])


def _correction_line(whose: str, correction: Sequence[float]) -> str:
    millimetres = ", ".join(f"{channel.label} {1e3 * correction[channel]:+.1f}" for channel in CABLES)
    meaning = {
        MEASURED: "on this hand",
        TYPICAL: "the mean of healthy hands",
        NONE: "the hand is taken as the map describes it",
    }
    return f"Correction of the cables: {whose} ({meaning.get(whose, 'that of this unit')}), mm: {millimetres}."


def _measurement(opened: Target, console: Console) -> Measurement:
    """Measure the cables of a free hand and print each correction, and the unsure ones in words."""
    with ProgressBar() as bar:
        task = bar.add_task("measuring the cables", total=1.0)
        found = measured_cables(opened, lambda done: bar.update(task, completed=done))
    console.print(_correction_line(MEASURED, found.correction))
    for channel, cable in found.cables.items():
        if not cable.sure:
            console.print(f"{channel.title}: {cable_text(cable)}.")
    return found


def _before_moving(opened: Target, policy: Policy, settings: RunSettings, *, measuring: bool) -> str:
    """Return the announcement: moving parts, duration, and stop conditions."""
    if settings.dry:
        return before_moving(opened, (0.0,) * len(Channel), 0.0).text
    grasp = policy.settings
    reach = furthest_codes(opened.map, *map(np.array, (grasp.nominal, grasp.scale, settings.correction)))
    moving_s = settings.wait_s + settings.seconds + 2 * settings.approach_s
    if not measuring:
        return before_moving(opened, (reach / MAX_CODE).tolist(), moving_s).text
    furthest = np.maximum(reach / MAX_CODE, [REACH.get(channel, 0.0) for channel in Channel])
    text = before_moving(opened, furthest.tolist(), moving_s + MEASURING_S).text
    return f"{text}\nThe cables are measured first: keep the hand free until it asks for the object."


def _recorded(opened: Target, path: Path | None, run: Callable[[Recorder, Progress], PolicyRun]) -> PolicyRun:
    """Run a policy and record it, to `path` if given, whatever the ending."""
    recorder, name = Recorder(opened, "policy", path), opened.describe()
    with ProgressBar() as bar:
        task = bar.add_task(name, total=1.0)

        def show(done: float, doing: str) -> None:
            bar.update(task, completed=done, description=f"{name}: {doing}")

        try:
            result = run(recorder, show)
        except BaseException:
            if recorder.begun:
                recorder.finish(ended=False)
                if path:
                    echo(f"recording up to here: {path}", err=True)
            raise
    recorder.finish(ended=result.run.ending is Ending.TIME)
    return result


def _outcome(result: PolicyRun, held: str, cube: CubeWatch | None, most_a: float) -> Table:
    """Return the result table; `held` is empty if the currents do not reveal it."""
    run, late_ms = result.run, 1e3 * np.percentile(result.lateness_s or (0.0,), (50, 99, 100))
    rows = {
        "ended because": run.ending.value,
        "guard": "stopped the hand" if run.ending is Ending.STOPPED else "saw nothing",
        "control periods": str(run.steps),
        "periods skipped": str(run.skipped),
        "actions slower than a period": str(run.slow),
        "actions cut off at the clip": str(run.clipped),
        "periods without a reading": str(run.missing),
        "periods outside the command window": str(run.saturated),
        "periods held back by the speed limit": str(run.limited),
        "peak temperature, °C": f"{run.peak_temperature_c:.0f}",
        "lateness, ms": "median {:.2f}, 99 % {:.2f}, most {:.2f}".format(*late_ms),
        "peak current, A": f"{run.peak_current_a:.2f} of {most_a:g}",
    }
    if held:
        rows["by the thumb's currents"] = held
    if cube is not None:
        turned = f"{cube.rotation_rad:.2f} rad in {cube.alive_s:.1f} s, {cube.rate_rad_s:.2f} rad/s"
        end = "lost" if cube.lost else "wedged in the hand" if cube.wedged else "in the hand"
        rows |= {"cube turned": turned, "cube at the end": end}
    table = Table(show_header=False)
    for row in rows.items():
        table.add_row(*row)
    return table
