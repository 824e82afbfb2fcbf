"""Experiment "policy": measure the cables, run a policy on a target, and record both.

Series, sampled once a control period: `codes` as read, `hand` (the codes as lengths of the simulator), `action`,
`goal` (commanded lengths), `command_codes` as written, `currents`; for an emulated hand with a cube also `posture`,
the ground truth of hand and cube. A measurement before the run adds `cable_wanted`, `cable_travel` and `cable_currents`
with times from its own start.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel, Joint
from aero.firmware import firmware_of
from aero.floats import Floats
from aero.policy.cables import TORQUE_SHARE, MeasuredCable, Measurement, Seen, measure
from aero.policy.file import Policy
from aero.policy.loop import run_policy
from aero.policy.running import Ending, Run, RunSettings, Step
from hil.recordings.recorder import Progress, Recorder, silent
from hil.recordings.recording import Series
from hil.targets.target import Target


class CubeWatched(Protocol):
    """Cube in a hand."""

    @property
    def postures(self) -> Sequence[Floats]:
        """True posture of hand and cube at each sample, in the columns of `POSTURE`."""

    def place(self) -> object:
        """Place the cube in the hand."""

    def sample(self) -> object:
        """Store the present posture."""


POSTURE = {joint.label: "rad" for joint in Joint} | dict.fromkeys(("cube_x", "cube_y", "cube_z"), "m")
POSTURE |= dict.fromkeys(("cube_qw", "cube_qx", "cube_qy", "cube_qz"), "1")
"""Columns of the series `posture` to their units, as `model.cube_plant.CubePlant.posture` returns them."""


class PolicyRun(NamedTuple):
    """Result of the experiment."""

    run: Run
    lateness_s: tuple[float, ...]
    currents_a: NDArray[np.float64]
    """Motor currents of each period, (periods, 7), A, command order; NaN where a reading is missing."""


def measured_cables(target: Target, moved: Callable[[float], None] = lambda _: None) -> Measurement:
    """Measure the cables of a free hand; `moved` is called with the progress, 0 to 1.

    Raises:
        AeroError, ConnectionError: a failed reading or command.
        SafetyStopError: the guard refuses to move the hand, or stopped it.
    """
    target.begin()
    if target.guard is not None:
        target.guard.limit_torques(TORQUE_SHARE)
    limited = firmware_of(target.firmware).settings is not None
    return measure(target.hand, target.clock, target.map, to_stops=limited, moved=moved)


def record_policy(
    target: Target,
    recorder: Recorder,
    policy: Policy,
    settings: RunSettings,
    *,
    progress: Progress = silent,
    cube: CubeWatched | None = None,
    correction: str = "",
    measurement: Measurement | None = None,
) -> PolicyRun:
    """Run `policy` on `target`.

    Args:
        target: hand of any kind; only its driver, clock, map and guard are used.
        recorder: recorder of the run, begun here.
        policy: policy to run.
        settings: settings of the run.
        progress: called after every control period.
        cube: cube placed in the hand at the policy's start, and sampled; None for none.
        correction: source of the settings' correction, stored in the recording.
        measurement: measurement of the cables before the run, stored in the recording; None without one.

    Raises:
        AeroError, ConnectionError: no reading before the policy's start, or no connection at the end.
        SafetyStopError: the guard refuses to move the hand.
    """
    if not settings.dry:
        target.begin()
        if target.guard is not None and policy.settings.torque_limit is not None:
            target.guard.limit_torques(policy.settings.torque_limit)
    times: list[float] = []
    lateness: list[float] = []
    currents: list[NDArray[np.float64]] = []
    period_s = (settings.settings or policy.settings).period_s

    parameters: dict[str, float | str] = {
        "policy": policy.name,
        "correction": correction,
        "shown_action": (settings.shown_action or policy.shown_action).value,
        "seconds_s": settings.seconds,
        "dry": float(settings.dry),
        **({} if policy.settings.torque_limit is None else {"torque_limit": policy.settings.torque_limit}),
        **{f"correction_{channel.label}": settings.correction[channel] for channel in Channel},
    }
    recorder.begin(parameters)

    if measurement is not None:
        _keep(recorder, measurement)

    def take(step: Step) -> None:
        rows: dict[str, NDArray[Any]] = {
            "codes": step.codes,
            "hand": step.lengths,
            "action": step.action,
            "goal": step.target,
            "command_codes": step.command,
            "currents": step.currents_a,
        }
        for name, row in rows.items():
            if np.isfinite(row).all():
                recorder.add(name, step.t, row)
        if cube is not None:
            cube.sample()
            times.append(step.t - recorder.start)
        lateness.append(step.late_s)
        currents.append(step.currents_a)
        progress(min(1.0, len(lateness) * period_s / settings.seconds), policy.name)

    def begin() -> None:
        recorder.note("the policy begins")
        if cube is not None:
            cube.place()

    recorder.note(f"policy {policy.name!r} {'reads only' if settings.dry else 'runs'}")
    progress(0.0, "going to the grasp")
    try:
        run = run_policy(
            policy,
            target.hand,
            target.clock,
            target.map,
            settings=settings,
            on_wait=lambda: progress(0.0, "put the object in"),
            on_ready=begin,
            on_step=take,
        )
    finally:
        if cube is not None and times:
            recorder.attach(
                "posture", Series.of(tuple(POSTURE), tuple(POSTURE.values()), times, np.array(cube.postures))
            )
    text = f"{run.ending.value}: {run.reason}" if run.reason else run.ending.value
    recorder.note(text, "info" if run.ending is Ending.TIME else "error")
    return PolicyRun(run, tuple(lateness), np.array(currents).reshape(-1, len(Channel)))


def _keep(recorder: Recorder, measurement: Measurement) -> None:
    """Store what was measured: three series, and a note for each cable."""
    samples, labels = measurement.samples, tuple(channel.label for channel in Channel)
    metres = tuple("rad" if channel is Channel.THUMB_ABDUCTION else "m" for channel in Channel)
    amperes = ("A",) * len(Channel)
    for name, units, rows in (
        ("cable_wanted", metres, samples.wanted),
        ("cable_travel", metres, samples.travel),
        ("cable_currents", amperes, samples.currents_a),
    ):
        recorder.attach(name, Series.of(labels, units, samples.times.tolist(), rows))
    for channel, cable in measurement.cables.items():
        recorder.note(f"cable {channel.label}: {cable_text(cable)}")


SOURCES = {
    Seen.SLACK: "from its slack",
    Seen.STOP: "from its closed stop",
    Seen.NEITHER: "just taut",
    Seen.NOTHING: "typical, because its stop was not approached",
}


def cable_text(cable: MeasuredCable) -> str:
    """Return correction, interval and source as words."""
    sure = "" if cable.sure else "unsure, "
    return f"{1e3 * cable.correction:+.1f} mm within {1e3 * cable.within:.1f}, {sure}{SOURCES[cable.seen]}"
