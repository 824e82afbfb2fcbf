"""Excitation of a hand for calibration: steps, ramps and chirps, small to large.

Every stream starts and ends with the open hand and stays inside `REACH`, where nothing of a healthy hand touches
anything else or an end stop. The fingers move together, for they bend side by side; each channel of the thumb moves
alone, since the thumb meets the fingers and its own channels pull at each other. Streams are data; `play` plays them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aero.channels import FINGERS, Channel
from aero.errors import AeroError
from aero.protocol import MAX_CODE
from aero.safety import SafetyStopError
from hil.recordings.recorder import Progress, Recorder, silent
from hil.targets.target import Target

Floats = NDArray[np.float64]

PERIOD_S = 0.021
"""Time from one frame to the next. No multiple of the board's 10 ms telemetry period, so that readings of every age
come by: the jump from the oldest to the newest tells where the recording lies on that grid, which is else mistaken for
the servos' delay."""
REST_S = 0.42
"""Rest before, between and after motions: a step settles within 0.14 s (one physical hand, public logs June-July 2026,
TTdragoAlex/tetherIA-aero-hand-open 58b518e)."""
REACH: Mapping[Channel, float] = {
    Channel.INDEX: 0.85,
    Channel.MIDDLE: 0.85,
    Channel.RING: 0.85,
    Channel.PINKY: 0.85,
    Channel.THUMB_ABDUCTION: 0.9,
    Channel.THUMB_CMC_FLEXION: 0.5,
    Channel.THUMB_FLEXOR: 0.7,
}
"""Largest share of the command window: fingers stop at 0.976, flexion at 0.605 without abduction, the flexor at 0.826
(the same hand)."""
STEP_SHARES = (0.05, 0.3, 1.0)
"""Steps there and back, as shares of the reach, small to large."""
STAIRS = 6
"""Stairs to the reach, and back."""
RAMP_SHARES_PER_S = (0.25, 0.75)
"""Speeds of ramps to the reach and back, in reaches a second."""
CHIRP_HZ = (0.5, 4.0)
"""First and last frequency of a chirp."""
CHIRP_S = 2.5
CHIRP_SHARES = (0.03, 0.08)
"""Amplitudes of the chirps about the middle of the reach; the larger one peaks at 1.6 of the window a second."""


@dataclass(frozen=True)
class Excitation:
    """A stream of commands on a fixed period."""

    name: str
    fractions: Floats
    """(n, 7) float, shares of the command window, command order, one row every `PERIOD_S`."""

    @property
    def duration_s(self) -> float:
        """Hand time, s."""
        return len(self.fractions) * PERIOD_S


def _rest(level: float = 0.0) -> Floats:
    return np.full(round(REST_S / PERIOD_S), level)


def steps() -> Floats:
    """Return steps there and back, small to large, then a staircase, (n,) float, shares of the reach."""
    parts = [_rest()]
    for share in STEP_SHARES:
        parts += [_rest(share), _rest()]
    stairs = np.linspace(1.0 / STAIRS, 1.0, STAIRS)
    parts += [_rest(level) for level in (*stairs, *stairs[-2::-1], 0.0)]
    return np.concatenate(parts)


def ramps() -> Floats:
    """Return ramps to the reach and back, slow to fast, (n,) float, shares of the reach."""
    parts = [_rest()]
    for rate in RAMP_SHARES_PER_S:
        up = np.linspace(0.0, 1.0, round(1.0 / rate / PERIOD_S))
        parts += [up, _rest(1.0), up[::-1], _rest()]
    return np.concatenate(parts)


def chirps() -> Floats:
    """Return sines of rising frequency about the middle of the reach, (n,) float, shares of the reach."""
    t = np.arange(0.0, CHIRP_S, PERIOD_S)
    first, last = CHIRP_HZ
    phase = 2.0 * np.pi * first * CHIRP_S / np.log(last / first) * ((last / first) ** (t / CHIRP_S) - 1.0)
    middle = np.linspace(0.0, 0.5, round(1.0 / PERIOD_S))
    parts = [_rest(), middle]
    for share in CHIRP_SHARES:
        parts += [0.5 + share * np.sin(phase), _rest(0.5)]
    return np.concatenate([*parts, middle[::-1], _rest()])


MOTIONS: Mapping[str, Callable[[], Floats]] = {"steps": steps, "ramps": ramps, "chirps": chirps}
"""Motions of one channel by name."""


def excitation(name: str, *, scale: float = 1.0, channels: tuple[Channel, ...] = tuple(Channel)) -> Excitation:
    """Return a named motion, or `all` of them one after the other, of the fingers together and each thumb channel.

    Args:
        name: a key of `MOTIONS`, or `all`.
        scale: share of the reach that is used, above 0 and at most 1.
        channels: which channels move: the fingers among them first, together, then the others in this order.

    Raises:
        ValueError: no such motion, a scale out of range, or no channel.
    """
    if name != "all" and name not in MOTIONS:
        raise ValueError(f"there is no excitation {name!r}; there are {', '.join(MOTIONS)} and all")
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
"""Frames from one reading of the temperatures to the next."""
OPENING_S = 2.0
"""Time of the way back to the open hand after an interruption, s."""
EXPERIMENT = "excitation"


def play(target: Target, recorder: Recorder, excitation: Excitation, *, progress: Progress = silent) -> None:
    """Play an excitation into a recorder; the hand ends open, on Ctrl-C too.

    Each frame reads positions and currents first and commands after, as a policy does.

    Args:
        target: the hand; it moves through the reach of the excitation.
        recorder: begun here. It is left with `codes`, `command_codes` (u16), `currents` (A) and `temperatures` (degC);
            after a stop by the guard, with an event of severity `error` that says why.
        excitation: what to play.
        progress: called once a frame.

    Raises:
        SafetyStopError: a guarded hand was stopped, or must not be moved at all.
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
        # A signal may have cut a write: what ended the run counts, and the guard opens the hand once more.
        with suppress(AeroError):
            _open(target, command)
        raise
    _open(target, command)


def _open(target: Target, command: NDArray[np.int64]) -> None:
    """Ramp from a command to the open hand; nothing to do when it asked for that already."""
    if not command.any():
        return
    start = target.clock.now()
    frames = round(OPENING_S / PERIOD_S)
    for frame in range(frames):
        target.clock.sleep_until(start + frame * PERIOD_S)
        target.hand.command_codes(np.rint(command * (1.0 - (frame + 1) / frames)).astype(np.int64))
