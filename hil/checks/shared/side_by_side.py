"""Parallel run of one command stream on the simulator and the hand."""

from collections.abc import Callable, Mapping

from aero.channels import Channel
from aero.floats import Floats
from hil.checks.shared.experiment import sample
from hil.recordings.recorder import Progress, Recorder, silent
from hil.targets.target import Target
from simulator.routed import RoutedHand

MODEL_STEP_S = 0.01
"""Time step of the routed hand and its trace, s."""


def follow(
    target: Target,
    recorder: Recorder,
    simulator: RoutedHand,
    commands: Floats,
    *,
    period_s: float,
    parameters: Mapping[str, float | str],
    doing: Callable[[int], str],
    progress: Progress = silent,
) -> None:
    """Send one stream of lengths to simulator and hand at a common rate.

    Every sample reads the encoders, then sends the command, as a policy's control loop does. A command beyond the
    hand's window is clipped to its end, with an event in the recording.

    Args:
        target: the hand.
        recorder: recorder, started by this function.
        simulator: routed hand of the target's side.
        commands: (n, 7) float, lengths, m and rad.
        period_s: command period, s, a multiple of `MODEL_STEP_S`.
        parameters: parameters of the experiment.
        doing: returns the activity at a sample's index, for the progress.
        progress: called once per sample.

    Records `command`, `model`, `hand` and `goal` (simulator length, m or rad; `goal` is the command converted to codes
    and back, equal to `hand` for an ideal hand), `travel` (cable wound in, m, or rad), `codes` and `command_codes`
    (u16), `currents` (A) and `temperatures` (degC).
    """
    clock, codec = target.clock, target.map
    goals, saturated = codec.saturating_codes(codec.angles_from_travel(codec.travel_from_lengths(commands)))
    recorder.begin(parameters)
    for channel in Channel:
        if saturated[:, channel].any():
            recorder.note(
                f"{channel.label} waits at the end of its command window in {saturated[:, channel].sum()} of "
                f"{len(commands)} samples: the map asks for more than the window allows"
            )
    simulator.reset()
    steps = round(period_s / MODEL_STEP_S)
    simulated = 0

    def simulate(count: int) -> None:
        nonlocal simulated
        for _ in range(count):
            recorder.add("model", recorder.start + simulated * MODEL_STEP_S, simulator.lengths())
            simulator.advance(MODEL_STEP_S)
            simulated += 1

    def catch_up(t: float, least: int) -> int:
        """Advance the simulator to time `t` if it lags by `least` steps or more; return the number of steps."""
        late = int((t - recorder.start) / MODEL_STEP_S) - simulated
        if late < least:
            return 0
        simulate(late)
        if late >= steps:
            recorder.note(
                f"this machine was {late * MODEL_STEP_S:.2f} s late; the stream continues from there", "warning"
            )
        return late

    try:
        for i, command in enumerate(commands):
            clock.sleep_until(recorder.start + simulated * MODEL_STEP_S)
            catch_up(clock.now(), steps)
            sent = sample(target, recorder, goals[i], i)
            # The reply may have taken time; simulator and hand get the command together.
            late = catch_up(sent, 1)
            recorder.add("command", sent, command)
            simulator.command(command)
            simulate(steps - late if late < steps else steps)
            progress((i + 1) / len(commands), doing(i))
    finally:  # also for an aborted run
        for series, source in (("hand", "codes"), ("goal", "command_codes")):
            recorder.derive(series, source, codec.lengths_from_codes)
        recorder.derive("travel", "codes", lambda codes: codec.travel_from_angles(codec.angles_from_codes(codes)))
