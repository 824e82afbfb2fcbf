"""Faults of a moving hand, and the time until the guard starts to open it."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest
from guarded_hands import BusyHost, Tampered, close, guarded, wait

from aero import Channel
from aero.channels import WIRE_ORDER
from aero.safety import SafetyReason, SafetyStopError, Thresholds
from firmware_emulator.plant import Drive
from hil.targets.target import Target

LATE = {"idle": 0.0, "late": 0.05}
"""Fraction of readings that are late by up to 0.1 s, by host."""


@dataclass(frozen=True)
class Stopping:
    """Fault that the guard must detect."""

    name: str
    most_s: float
    """Limit of the time on either host, s."""
    reasons: tuple[SafetyReason, ...]
    """Permitted reasons of the stop."""
    channel: Channel
    fault: Callable[[Target], None]
    before: Callable[[Target], None] = close
    options: dict[str, Any] = field(default_factory=dict)
    """Options of the guarded hand."""

    def seconds(self, host: str, seed: int) -> float:
        """Return the time from the fault to the start of the opening, s."""
        with guarded(link=lambda electronics: BusyHost(electronics, seed), **self.options) as target:
            self.before(target)
            target.wire._transport.late = LATE[host]
            wait(target, 0.5 + 0.013 * seed)
            return self._time_to_opening(target)

    def _time_to_opening(self, target: Any, wait_s: float = 6.0) -> float:
        began, openings = target.clock.now(), []
        guard = target.hand._guard
        opening = guard._open
        guard._open = lambda reason, **how: (openings.append(target.clock.now()), opening(reason, **how))[1]
        self.fault(target)
        with pytest.raises(SafetyStopError) as stop:
            wait(target, wait_s)
        assert stop.value.reason in self.reasons
        assert stop.value.channel is self.channel
        return float(openings[0] - began)


def _jump(target: Target) -> None:
    servo = target.truth.electronics.servos[WIRE_ORDER.index(Channel.MIDDLE)]
    servo.frame.set_offset(900)
    servo.feedback.invalidate()


def _resting(target: Target) -> None:
    close(target, Channel.MIDDLE, share=0.3)
    wait(target, 3.0)


def _runs_away(drive: Drive) -> Drive:
    return dataclasses.replace(drive, setpoint=4.0) if drive.setpoint > 0.5 else drive


STOPPINGS = (
    # Between two polls 900 counts are 13 000 counts/s or a little less, by their phase; what is less is astray.
    Stopping("jump of 900 counts", 0.5, (SafetyReason.JUMP, SafetyReason.STRAY), Channel.MIDDLE, _jump, _resting),
    Stopping(
        "runaway, from the command on",
        1.0,
        (SafetyReason.STRAY,),
        Channel.PINKY,
        lambda target: close(target, Channel.PINKY, share=0.2),
        options={"rewire": lambda plant: Tampered(plant, Channel.PINKY, _runs_away)},
    ),
    # The thumb meets the palm about 0.25 s after the command.
    Stopping(
        "thumb blocked by the palm, from the command on",
        1.5,
        (SafetyReason.CURRENT,),
        Channel.THUMB_CMC_FLEXION,
        lambda target: close(target, Channel.THUMB_CMC_FLEXION),
        options={"thresholds": Thresholds(stop_torque=700)},
    ),
    Stopping(
        "channel without torque, from the command on",
        3.0,
        (SafetyReason.STRAY,),
        Channel.RING,
        lambda target: close(target, Channel.RING, share=0.9),
        options={"rewire": lambda plant: Tampered(plant, Channel.RING, lambda _: Drive(powered=False))},
    ),
)
