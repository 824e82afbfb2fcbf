"""Driver and map: did the bytes say what was commanded, and did the readings say what the bytes said?

Needs no ground truth. The frames of a recording are read a second time, by the board's own layout of words
(`firmware_emulator`) and by the paper's equations (`independent_map`), which share no code with `aero`. It is no
experiment of its own: it is measured on the recording of each, and the worst counts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.firmware import firmware_of
from firmware_emulator.firmware.frames import FRAME_SIZE, Opcode, reply, words_of
from firmware_emulator.firmware.hands import SHAFT_OF_SERVO
from hil.checks.driver.independent_map import MAP, codes_of_lengths, lengths_of_codes
from hil.checks.shared.exchanges import Exchange, exchanges
from hil.checks.shared.experiment import Measured
from hil.recordings.recording import Recording, Series

Floats = NDArray[np.float64]

CURRENT_A = 6.5e-3
"""Current of one register unit, nominal (maker's memory table of the HLS3606M)."""
SAME_TIME_S = 1e-6
"""Times of one instant differ by less in a file, which keeps nanoseconds."""
AHEAD = 4
"""Requests after a reading that have to be in order, too, for it to be compared."""
CANDIDATES = 4
"""Requests of one kind that may have brought a reading: the driver's, and looks of a guard beside it."""
REFUSED_SETTING = reply(Opcode.SET_TOR, [0xFFFF])
"""A torque limit for a channel that no board has."""
_SERVO_OF_CHANNEL = np.argsort(SHAFT_OF_SERVO)
_NOTHING = np.empty((0, len(Channel)))
READ = {"codes": Opcode.GET_POS, "currents": Opcode.GET_CURR, "temperatures": Opcode.GET_TEMP}
"""Series of readings to the request that brings them."""
STEP = {"codes": 1.0, "currents": CURRENT_A, "temperatures": 1.0}
"""Smallest difference of two readings."""


def measure(recording: Recording) -> Measured:
    """Return the largest differences between commands and bytes and between bytes and readings, 0 without either.

    By channel: `sent` and `mapped` (codes), `read_wrong` (steps of the reading, over all kinds), `mapped_back` (mm,
    mrad), `mapped_bias` (codes), the mean of `mapped`; of the hand: `unsent`, commands that no frame followed, `extra`,
    frames that no command asked for, and `limits`, speed and torque limits that are not those that a validation sets.
    """
    requests = exchanges(recording.wire)
    sent, unsent, extra = _sent(recording, requests)
    found = dict.fromkeys(("mapped", "mapped_back"), _NOTHING) | dict(_mapped(recording))
    found |= {"sent": sent, "read_wrong": np.vstack([_NOTHING, *_read(recording, requests)])}
    worst = {name: np.abs(rows).max(axis=0, initial=0.0) for name, rows in found.items()}
    by_channel = {c.label: {name: float(values[c]) for name, values in worst.items()} for c in Channel}
    bias = np.abs(found["mapped"].mean(axis=0)) if len(found["mapped"]) else np.zeros(len(Channel))
    for channel in Channel:
        by_channel[channel.label]["mapped_bias"] = float(bias[channel])
    return {
        **by_channel,
        "hand": {"unsent": float(unsent), "extra": float(extra), "limits": _limits(recording, requests)},
    }


def _limits(recording: Recording, requests: Sequence[Exchange]) -> float:
    """Return the number of limits that are not the firmware's own, which a validation without a guard sets.

    It sets them after it has asked the board whether it knows limits, by `REFUSED_SETTING`. What
    comes after the last command may restore those of before.
    """
    own = firmware_of(recording.header.firmware).settings
    at = [i for i, request in enumerate(requests) if request.opcode == Opcode.CTRL_POS]
    asked = [i for i, request in enumerate(requests) if request.frame == REFUSED_SETTING]
    if recording.header.safety or own is None or not at or not asked:
        return 0.0
    wanted = {Opcode.SET_SPE: own.speed, Opcode.SET_TOR: own.torque}
    sent = [request.frame for request in requests[asked[-1] + 1 : at[-1]] if request.opcode in wanted]
    return float(sum(words_of(frame)[1] != wanted[Opcode(frame[0])] for frame in sent))


def _answered(made: Exchange) -> bool:
    """Whether a reading has one whole reply, and a command none; other requests are answered in their own ways."""
    if made.opcode in READ.values():
        return len(made.received) == FRAME_SIZE and made.received.startswith(bytes((made.opcode, 0)))
    return made.opcode != Opcode.CTRL_POS or not made.received


def _sent(recording: Recording, requests: Iterable[Exchange]) -> tuple[Floats, int, int]:
    """Return the codes of each frame less those asked for, (n, 7), commands without a frame, and frames too many."""
    series = recording.series.get("command_codes")
    frames = [request for request in requests if request.opcode == Opcode.CTRL_POS]
    if series is None or not recording.wire:
        return _NOTHING, 0, 0
    times = np.array([request.t for request in frames])
    # Of two rows at one time, the first says where the hand stood before.
    ends = np.append(series.times[1:], np.inf)
    # The log forgets the oldest bytes of a very long recording.
    given = (ends - series.times >= SAME_TIME_S) & (series.times > recording.wire[0].t - SAME_TIME_S)
    first = np.searchsorted(times, series.times[given] - SAME_TIME_S)
    sent = np.append(times, np.inf)[first] < ends[given] - SAME_TIME_S
    words = _values([request.frame for request in frames])
    # The last command has no end.
    until = np.searchsorted(times, ends[given][:-1] - SAME_TIME_S)
    extra = int(np.maximum(until - first[:-1] - 1, 0).sum())
    return words[first[sent]] - series.values[given][sent], int(np.count_nonzero(~sent)), extra


def _mapped(recording: Recording) -> Iterator[tuple[str, Floats]]:
    """Yield what the map under test gave less what the paper's equations give."""
    header, series = recording.header, recording.series
    if header.map != MAP:
        return
    if {"command", "command_codes"} <= series.keys():
        # A link that ends while a command is answered leaves its code without its length.
        lengths = series["command"].values
        codes = series["command_codes"].values[: len(lengths)]
        yield "mapped", codes - codes_of_lengths(lengths, header.window)
    if {"hand", "codes"} <= series.keys():
        lengths = lengths_of_codes(series["codes"].values, header.window)
        yield "mapped_back", 1e3 * (series["hand"].values - lengths)


def _read(recording: Recording, requests: Sequence[Exchange]) -> Iterator[Floats]:
    """Yield the readings of each kind less their replies, (n, 7) in steps of the reading."""
    answered = np.array([_answered(request) for request in requests], bool)
    opcodes = np.array([request.opcode for request in requests], int)
    # Once a link has lost, delayed or damaged a reply, which frame a driver takes is its own affair: what counts are
    # requests that were answered as they should be, as all before them and the next ones were.
    disorder = np.flatnonzero(~answered)
    until = max(int(disorder[0]) - AHEAD, 0) if disorder.size else len(requests)
    until_s = requests[until].t if disorder.size else np.inf
    for name, opcode in READ.items():
        if name in recording.series:
            made = [requests[at] for at in np.flatnonzero(answered & (opcodes == opcode)).tolist()]
            yield _unlike(recording.series[name], made, opcode, until_s) / STEP[name]


def _unlike(series: Series, made: Sequence[Exchange], opcode: Opcode, until_s: float) -> Floats:
    """Return readings less the reply that is most like them, (n, 7), where the link was in order.

    A reading's time is taken before or after it is asked for, and a guard may poll the hand in between. So the reply
    is that to the last request before this time, or to one between it and the next reading.

    Args:
        series: readings of a kind.
        made: requests of that kind that were answered.
        opcode: what asks for it.
        until_s: until when the link was in order.
    """
    if not made:
        return _NOTHING
    times = np.array([exchange.t for exchange in made])
    last = np.searchsorted(times, series.times + SAME_TIME_S) - 1
    # Noted after it has come, a reading may share its time with the guard's next poll.
    at_requests = np.mean(np.abs(times[last] - series.times) < SAME_TIME_S) > 0.5
    either = last + np.arange(0 if at_requests else -1, CANDIDATES)[:, None]
    there = (either >= 0) & (either < len(made))
    either = np.where(there, either, 0)
    there &= (either <= last) | (times[either] < np.append(series.times[1:], np.inf) - SAME_TIME_S)
    gaps = series.values - _readings([exchange.received for exchange in made], opcode)[either]
    nearer = np.where(there, np.abs(gaps).sum(axis=2), np.inf).argmin(axis=0)
    # A reading from then on may be of a request that was not answered as it should be.
    judged = (
        there.any(axis=0) & (series.times < until_s - SAME_TIME_S) & ((times[either] < until_s) | ~there).all(axis=0)
    )
    unlike: Floats = gaps[nearer, np.arange(len(nearer))][judged]
    return unlike


def _readings(frames: Sequence[bytes], opcode: Opcode) -> Floats:
    values = _values(frames)
    return CURRENT_A * np.where(values > 0x7FFF, values - 0x10000, values) if opcode == Opcode.GET_CURR else values


def _values(frames: Sequence[bytes]) -> Floats:
    """Return the words of frames in command order, (n, 7) float."""
    words = np.array([words_of(frame) for frame in frames], float).reshape(-1, len(Channel))
    return words[:, _SERVO_OF_CHANNEL]
