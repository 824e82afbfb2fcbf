"""`aero-hil replay`: recorded bytes resent to a hand at the recorded times, with a comparison of the replies.

No driver is involved. An emulated hand has the recorded side, firmware, unit and seed unless options override them, and
starts like the recorded one, so it returns identical bytes. On another hand, the difference is a measurement.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from aero.channels import Channel
from aero.firmware import FIRMWARE
from aero.protocol import FRAME_SIZE, Opcode, parse_reply, unsigned_values
from hil.cli.exits import usage_errors
from hil.cli.options import RECORDING, TARGET, open_hand
from hil.cli.output_files import RECORDED
from hil.dialogue.printing import echo
from hil.emulated.emulated_spec import named_spec
from hil.recordings.mcap_file import read_recording, write_recording
from hil.recordings.provenance import source_commit, versions
from hil.recordings.recording import Header, Recording
from hil.targets.hand_spec import PHYSICAL
from hil.targets.hands_file import fields_of
from hil.targets.target import Target
from hil.targets.wire_log import WireRecord

LAST_REPLY_S = 0.1


@dataclass(frozen=True)
class ReplyComparison:
    """Comparison of two recordings of identical requests."""

    requests: int
    identical: int
    """Number of requests with identical replies."""
    position_rms: NDArray[np.float64]
    """RMS difference of the encoders, (7,), u16, over common position replies; NaN without any."""


def check_replayable(recording: Recording, target: Target) -> None:
    """Check that a recording can be replayed on a target.

    Raises:
        ValueError: the recording has no bytes to the hand, or the hand is guarded, because the bytes would bypass the
            guard.
    """
    if target.guard is not None:
        raise ValueError(
            f"{target.port} is guarded, and a replay writes bytes that no guard sees, settings and homing among them. "
            "Replay on `emulated` or `pty`; to move a hand on a port again, run the experiment on it."
        )
    if all(record.direction != "to_hand" for record in recording.wire):
        raise ValueError("this recording holds no bytes to the hand, so there is nothing to replay")


def resend(recording: Recording, target: Target) -> Recording:
    """Resend every byte of a recording to a target and record the replies.

    Raises:
        ValueError: as `check_replayable`.
    """
    check_replayable(recording, target)
    sent = [record for record in recording.wire if record.direction == "to_hand"]
    mark, start = target.wire.mark(), target.clock.now()
    for record in sent:
        _read_until(target, start + record.t)
        target.wire.write(record.data)
    _read_until(target, start + sent[-1].t + LAST_REPLY_S)
    header = dataclasses.replace(
        recording.header,
        target=target.port,
        side=target.side,
        firmware=target.firmware,
        unit=target.unit,
        seed=target.seed,
        versions=versions(),
        commit=source_commit(),
    )
    return Recording(header, {}, target.wire.since(mark, start))


def compare_replies(first: Recording, second: Recording) -> ReplyComparison:
    """Compare the replies of two hands to identical bytes, request by request.

    Raises:
        ValueError: the requests differ.
    """
    one, other = replies(first.wire), replies(second.wire)
    if [request for request, _ in one] != [request for request, _ in other]:
        raise ValueError(
            f"the two recordings hold different requests ({len(one)} and {len(other)}); "
            "compare a recording with a replay of it"
        )
    pairs = [(a, b) for (_, a), (_, b) in zip(one, other, strict=True)]
    readings = [
        [unsigned_values(parse_reply(frame)).astype(float) for frame in pair]
        for pair in pairs
        if len(pair[0]) == len(pair[1]) == FRAME_SIZE and pair[0][0] == pair[1][0] == Opcode.GET_POS
    ]
    difference = np.array([a - b for a, b in readings]).reshape(-1, len(Channel))
    rms = np.sqrt(np.mean(np.square(difference), axis=0)) if len(difference) else np.full(len(Channel), np.nan)
    return ReplyComparison(len(pairs), sum(a == b for a, b in pairs), rms)


def replies(wire: tuple[WireRecord, ...]) -> list[tuple[bytes, bytes]]:
    """Return each write to the hand with all bytes received before the next one."""
    found: list[tuple[bytes, bytes]] = []
    for record in wire:
        if record.direction == "to_hand":
            found.append((record.data, b""))
        elif found:
            found[-1] = (found[-1][0], found[-1][1] + record.data)
    return found


def _read_until(target: Target, t: float) -> None:
    """Discard received bytes and return at time `t` (s on the target's clock)."""
    target.clock.sleep_until(t)
    while target.wire.read(FRAME_SIZE, 0.0):
        pass


@click.command()
@click.argument("recording", type=RECORDING)
@TARGET
@click.option("--firmware", type=click.Choice(FIRMWARE), help="Version; the recorded one if not given.")
@click.option("--unit", help="Unit of an emulated hand; the recorded one if not given.")
@click.option("--out", type=RECORDED, help="Write the new recording here.")
def replay(*, recording: Path, target_name: str, firmware: str | None, unit: str | None, out: Path | None) -> None:
    """Send the bytes of RECORDING to a hand again and compare the answers."""
    with usage_errors():
        recorded = read_recording(recording)
        header = recorded.header
        if out is not None:
            RECORDED.prepared(out)
        said = fields_of(target_name)  # a name in hands.toml overrides the recording
        spec = named_spec(
            target_name,
            firmware=firmware or said.get("firmware", header.firmware),
            side=said.get("side", header.side),
            unit=unit or _unit(header),
            seed=header.seed,
        )
    with open_hand(spec) as opened:
        with usage_errors():
            check_replayable(recorded, opened)
        replayed = resend(recorded, opened)
    comparison = compare_replies(recorded, replayed)
    if out is not None:
        write_recording(replayed, out)
    echo(f"{comparison.identical} of {comparison.requests} requests answered with the same bytes")
    if not np.isnan(comparison.position_rms).all():
        rms = ", ".join(f"{channel.label} {comparison.position_rms[channel]:.0f}" for channel in Channel)
        echo(f"rms difference of the encoders, of 65535: {rms}")


def _unit(header: Header) -> str:
    """Return the unit that represents the recorded hand.

    Raises:
        ValueError: a file, which is not opened because a recording names it.
    """
    if header.unit.endswith(".toml"):
        raise ValueError(f"the recorded unit is the file {header.unit!r}; give it with --unit")
    return "reference" if header.unit == PHYSICAL else header.unit
