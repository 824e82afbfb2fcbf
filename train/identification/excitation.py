"""Excitation of a hand for calibration: steps, ramps and chirps, small to large.

Every stream starts and ends with the open hand and stays inside `REACH`, without contacts or end stops on a healthy
hand. The fingers move together, because they cannot collide with each other. Each thumb channel moves alone, because
the thumb can meet the fingers and its channels are coupled.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import FINGERS, Channel
from aero.errors import AeroError
from aero.floats import Floats
from aero.protocol import MAX_CODE
from aero.safety import SafetyStopError
from hil.recordings.recorder import Progress, Recorder, silent
from hil.targets.target import Target

PERIOD_S = 0.021
"""Frame period, s. It is not a multiple of the board's 10 ms telemetry period, so the readings have every age from 0 to
10 ms. Their jump from the oldest to the newest shows the recording's phase, which otherwise looks like servo delay."""
REST_S = 0.42
"""Rest before, between and after motions, s; a step settles within 0.14 s (one physical hand, public logs June-July
2026, TTdragoAlex/tetherIA-aero-hand-open 58b518e)."""
REACH: Mapping[Channel, float] = {
    Channel.INDEX: 0.85,
    Channel.MIDDLE: 0.85,
    Channel.RING: 0.85,
    Channel.PINKY: 0.85,
    Channel.THUMB_ABDUCTION: 0.9,
    Channel.THUMB_CMC_FLEXION: 0.5,
    Channel.THUMB_FLEXOR: 0.7,
}
"""Largest command, fraction of the window. The hand of `REST_S` blocks its fingers at 0.976, CMC flexion without
abduction at 0.605, the flexor at 0.826."""
STEP_SHARES = (0.05, 0.3, 1.0)
"""Heights of the steps, each with its return, as fractions of the reach."""
STAIRS = 6
RAMP_SHARES_PER_S = (0.25, 0.75)
"""Speeds of the ramps to the reach and back, fractions of the reach per second."""
CHIRP_HZ = (0.5, 4.0)
"""First and last frequency of a chirp."""
CHIRP_S = 2.5
CHIRP_SHARES = (0.03, 0.08)
"""Amplitudes of the chirps about the middle of the reach, fractions of the reach; the peak speed is 1.6 windows/s."""


@dataclass(frozen=True)
class Excitation:
    """Stream of commands with a fixed period."""

    name: str
    fractions: Floats
    """(n, 7) float, fractions of the command window, command order, one row per `PERIOD_S`."""

    @property
    def duration_s(self) -> float:
        """Hand time, s."""
        return len(self.fractions) * PERIOD_S


def _rest(level: float = 0.0) -> Floats:
    return np.full(round(REST_S / PERIOD_S), level)


def steps() -> Floats:
    """Return steps with their returns, small to large, then a staircase, (n,) float, fractions of the reach."""
    parts = [_rest()]
    for share in STEP_SHARES:
        parts += [_rest(share), _rest()]
    stairs = np.linspace(1.0 / STAIRS, 1.0, STAIRS)
    parts += [_rest(level) for level in (*stairs, *stairs[-2::-1], 0.0)]
    return np.concatenate(parts)


def ramps() -> Floats:
    """Return ramps to the reach and back, slow to fast, (n,) float, fractions of the reach."""
    parts = [_rest()]
    for rate in RAMP_SHARES_PER_S:
        up = np.linspace(0.0, 1.0, round(1.0 / rate / PERIOD_S))
        parts += [up, _rest(1.0), up[::-1], _rest()]
    return np.concatenate(parts)


def chirps() -> Floats:
    """Return sines of rising frequency about the middle of the reach, (n,) float, fractions of the reach."""
    t = np.arange(0.0, CHIRP_S, PERIOD_S)
    first, last = CHIRP_HZ
    phase = 2.0 * np.pi * first * CHIRP_S / np.log(last / first) * ((last / first) ** (t / CHIRP_S) - 1.0)
    middle = np.linspace(0.0, 0.5, round(1.0 / PERIOD_S))
    parts = [_rest(), middle]
    for share in CHIRP_SHARES:
        parts += [0.5 + share * np.sin(phase), _rest(0.5)]
    return np.concatenate([*parts, middle[::-1], _rest()])


MOTIONS: Mapping[str, Callable[[], Floats]] = {"steps": steps, "ramps": ramps, "chirps": chirps}


def excitation(name: str, *, scale: float = 1.0, channels: tuple[Channel, ...] = tuple(Channel)) -> Excitation:
    """Return one motion, or `all` in sequence, of the fingers together and of each thumb channel.

    Args:
        name: a key of `MOTIONS`, or `all`.
        scale: factor on the reach, above 0 and at most 1.
        channels: moved channels: first the fingers together, then each other channel in this order.

    Raises:
        ValueError: unknown motion, a scale out of range, or no channel.
    """
    if name != "all" and name not in MOTIONS:
        raise ValueError(f"unknown excitation {name!r}; choose from {', '.join(MOTIONS)} and all")
    if not 0.0 < scale <= 1.0:
        raise ValueError(f"scale is a share of the safe reach, above 0 and at most 1, not {scale}")
    if not channels:
        raise ValueError("an excitation moves at least one channel")
    motion = np.concatenate([MOTIONS[key]() for key in (MOTIONS if name == "all" else (name,))])
    rows = []
    fingers = tuple(channel for channel in channels if channel in FINGERS)
    for together in (fingers, *((channel,) for channel in channels if channel not in FINGERS)):
        row = np.zeros((len(motion), len(Channel)))
        for channel in together:
            row[:, channel] = scale * REACH[channel] * motion
        rows += [row] if together else []
    return Excitation(name, np.concatenate(rows))


TEMPERATURE_EVERY = 25
"""Number of frames between two readings of the temperatures."""
OPENING_S = 2.0
"""Duration of the ramp to the open hand after an interruption, s."""
EXPERIMENT = "excitation"


def play(target: Target, recorder: Recorder, excitation: Excitation, *, progress: Progress = silent) -> None:
    """Play an excitation and record it; open the hand at the end, also after Ctrl-C.

    Each frame reads positions and currents, then commands, as a policy's control loop does.

    Args:
        target: the hand to move.
        recorder: recorder, started by this function. Series: `codes`, `command_codes` (u16), `currents` (A),
            `temperatures` (degC). A stop by the guard adds an event of severity `error` with the reason.
        excitation: commands to play.
        progress: called once per frame.

    Raises:
        SafetyStopError: the guard stopped the hand, or refused to move it.
    """
    hand, clock = target.hand, target.clock
    target.begin()
    recorder.begin({"excitation": excitation.name, "period_s": PERIOD_S})
    codes = np.rint(excitation.fractions * MAX_CODE).astype(np.int64)
    command = codes[0]
    try:
        for frame, wanted in enumerate(codes):
            clock.sleep_until(recorder.start + frame * PERIOD_S)
            now = clock.now()
            recorder.add("codes", now, hand.read_codes())
            recorder.add("currents", now, hand.read_currents())
            if frame % TEMPERATURE_EVERY == 0:
                recorder.add("temperatures", now, hand.read_temperatures())
            sent = clock.now()
            hand.command_codes(wanted)
            recorder.add("command_codes", sent, wanted)
            command = wanted
            progress((frame + 1) / len(codes), excitation.name)
    except SafetyStopError as stop:
        recorder.note(str(stop), "error")
        raise  # the guard opens the hand itself
    except BaseException:
        # A signal may have interrupted a write, so opening can fail. The original exception matters more, and a guard
        # opens the hand again.
        with suppress(AeroError):
            _open(target, command)
        raise
    _open(target, command)


def _open(target: Target, command: NDArray[np.int64]) -> None:
    """Ramp from a command to the open hand; return at once if the command is open."""
    if not command.any():
        return
    start = target.clock.now()
    frames = round(OPENING_S / PERIOD_S)
    for frame in range(frames):
        target.clock.sleep_until(start + frame * PERIOD_S)
        target.hand.command_codes(np.rint(command * (1.0 - (frame + 1) / frames)).astype(np.int64))
