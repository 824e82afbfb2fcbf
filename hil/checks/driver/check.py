"""Driver and map: commands against sent bytes, and readings against received bytes.

Needs no ground truth. The recorded frames are decoded a second time by the firmware's word
layout (`independent_frames`) and by the paper's equations (`independent_map`), which share no code with `aero`. Not an
experiment: measured on the recording of each experiment, and the worst result counts.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from aero.channels import Channel
from aero.firmware import firmware_of
from aero.floats import Floats
from hil.checks.driver.independent_frames import FRAME, SERVO_OF_CHANNEL, Opcode, words_of
from hil.checks.driver.independent_map import MAP, codes_of_lengths, lengths_of_codes
from hil.checks.shared.exchanges import Exchange, exchanges
from hil.checks.shared.experiment import UNASKED, UNCLIPPED, Measured
from hil.recordings.recording import Recording, Series

CURRENT_A = 6.5e-3
"""Current of one register unit, A, nominal. Source: maker's memory table of the HLS3606M."""
SAME_TIME_S = 1e-6
"""Tolerance of equal times, s; a file stores nanoseconds."""
AHEAD = 4
"""Number of following requests that must be in order too before a reading is compared."""
CANDIDATES = 4
"""Number of requests of one kind that may have returned a reading: the driver's, and polls of the guard."""
REFUSED_SETTING = FRAME.pack(Opcode.SET_TOR, 0, 0xFFFF, *(0,) * 6)
"""Torque limit for a nonexistent channel, which every board refuses."""
_NOTHING = np.empty((0, len(Channel)))
READ = {"codes": Opcode.GET_POS, "currents": Opcode.GET_CURR, "temperatures": Opcode.GET_TEMP}
"""Request of each series of readings."""
STEP = {"codes": 1.0, "currents": CURRENT_A, "temperatures": 1.0}
"""Smallest difference of two readings."""


def measure(recording: Recording) -> Measured:
    """Return the largest differences of commands against bytes and of readings against bytes, 0 without either.

    By channel: `sent` and `mapped` (codes), `read_wrong` (steps of the reading, over all kinds), `mapped_back` (mm,
    mrad), `mapped_bias` (codes, the mean of `mapped`). Of the hand: `unsent` (commands without a frame), `extra`
    (frames without a command), `limits` (speed and torque limits other than a validation's), `unasked` (readings
    that the driver returned without a request) and `unclipped` (window ends beyond which the map returns another code).
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
        "hand": {
            "unsent": float(unsent),
            "extra": float(extra),
            "limits": _limits(recording, requests),
            "unasked": float(recording.header.parameters.get(UNASKED, 0.0)),
            "unclipped": float(recording.header.parameters.get(UNCLIPPED, 0.0)),
        },
    }


def _limits(recording: Recording, requests: Sequence[Exchange]) -> float:
    """Return the number of limits that differ from the firmware's own, which an unguarded validation sets.

    A validation sets limits after probing the board's support with `REFUSED_SETTING`. Frames after the last command may
    restore earlier limits.
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
    """Return whether a reading has exactly one reply, or a command none; True for other requests."""
    if made.opcode in READ.values():
        return len(made.received) == FRAME.size and made.received.startswith(bytes((made.opcode, 0)))
    return made.opcode != Opcode.CTRL_POS or not made.received


def _sent(recording: Recording, requests: Iterable[Exchange]) -> tuple[Floats, int, int]:
    """Return sent minus commanded codes, (n, 7), commands without a frame, and surplus frames."""
    series = recording.series.get("command_codes")
    frames = [request for request in requests if request.opcode == Opcode.CTRL_POS]
    if series is None or not recording.wire:
        return _NOTHING, 0, 0
    times = np.array([request.t for request in frames])
    # of two rows at one time, the first is the position before
    ends = np.append(series.times[1:], np.inf)
    # the log drops the oldest bytes of a very long recording
    given = (ends - series.times >= SAME_TIME_S) & (series.times > recording.wire[0].t - SAME_TIME_S)
    first = np.searchsorted(times, series.times[given] - SAME_TIME_S)
    sent = np.append(times, np.inf)[first] < ends[given] - SAME_TIME_S
    words = _values([request.frame for request in frames])
    # the last command has no end
    until = np.searchsorted(times, ends[given][:-1] - SAME_TIME_S)
    extra = int(np.maximum(until - first[:-1] - 1, 0).sum())
    return words[first[sent]] - series.values[given][sent], int(np.count_nonzero(~sent)), extra


def _mapped(recording: Recording) -> Iterator[tuple[str, Floats]]:
    """Yield the output of the map under test minus that of the paper's equations."""
    header, series = recording.header, recording.series
    if header.map != MAP:
        return
    if {"command", "command_codes"} <= series.keys():
        # a link lost during a command leaves a code without its length
        lengths = series["command"].values
        codes = series["command_codes"].values[: len(lengths)]
        yield "mapped", codes - codes_of_lengths(lengths, header.window)
    if {"hand", "codes"} <= series.keys():
        lengths = lengths_of_codes(series["codes"].values, header.window)
        yield "mapped_back", 1e3 * (series["hand"].values - lengths)


def _read(recording: Recording, requests: Sequence[Exchange]) -> Iterator[Floats]:
    """Yield the readings of each kind minus the replies, (n, 7) in steps of the reading."""
    answered = np.array([_answered(request) for request in requests], bool)
    opcodes = np.array([request.opcode for request in requests], int)
    # After a lost, late or damaged reply, frames and readings cannot be paired reliably. Only requests with proper
    # replies count, with all earlier and the next requests in order too.
    disorder = np.flatnonzero(~answered)
    until = max(int(disorder[0]) - AHEAD, 0) if disorder.size else len(requests)
    until_s = requests[until].t if disorder.size else np.inf
    for name, opcode in READ.items():
        if name in recording.series:
            made = [requests[at] for at in np.flatnonzero(answered & (opcodes == opcode)).tolist()]
            yield _unlike(recording.series[name], made, opcode, until_s) / STEP[name]


def _unlike(series: Series, made: Sequence[Exchange], opcode: Opcode, until_s: float) -> Floats:
    """Return readings minus the most similar reply, (n, 7), while the link was in order.

    The time stamp of a reading is from before or after its request, and a guard may poll the hand in between. The
    reply therefore belongs to the last request before this time, or to one between this time and the next reading.

    Args:
        series: readings of one kind.
        made: answered requests of that kind.
        opcode: opcode of the requests.
        until_s: end of the time with an orderly link, s.
    """
    if not made:
        return _NOTHING
    times = np.array([exchange.t for exchange in made])
    last = np.searchsorted(times, series.times + SAME_TIME_S) - 1
    # A reading timed after its reply may share the time of the guard's next poll.
    at_requests = np.mean(np.abs(times[last] - series.times) < SAME_TIME_S) > 0.5
    either = last + np.arange(0 if at_requests else -1, CANDIDATES)[:, None]
    there = (either >= 0) & (either < len(made))
    either = np.where(there, either, 0)
    there &= (either <= last) | (times[either] < np.append(series.times[1:], np.inf) - SAME_TIME_S)
    gaps = series.values - _readings([exchange.received for exchange in made], opcode)[either]
    nearer = np.where(there, np.abs(gaps).sum(axis=2), np.inf).argmin(axis=0)
    # a later reading may belong to a request without a proper reply
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
    return words[:, SERVO_OF_CHANNEL]
