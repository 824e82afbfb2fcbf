"""Settings of a policy: rate, nominal grasp, scales and noise, with the paper's two sets as presets."""

from dataclasses import dataclass
from math import inf, isfinite

from aero.policy.task import CHANNELS

Row = tuple[float, ...]
"""One value a channel, command order; m, abduction rad."""


MOST_TARGET = 10.0
"""Limit of targets, scales and noise, m or rad; far beyond any cable or joint."""
RATE_HZ = (0.01, 1000.0)
"""Range of the control rate, Hz; a hand answers about 300 requests a second."""
_RANGES: dict[str, dict[str, float]] = {
    "nominal": {"least": -MOST_TARGET, "most": MOST_TARGET},
    "scale": {"above": 0.0, "most": MOST_TARGET},
    "noise": {"least": 0.0, "most": MOST_TARGET},
}


def checked_number(name: str, value: float, *, least: float = -inf, above: float = -inf, most: float = inf) -> None:
    """Refuse a number that is not finite or out of range.

    A range comparison alone would accept NaN, which would reach the hand as a position.

    Raises:
        ValueError: the message has name, range and value.
    """
    if not (isfinite(value) and least <= value <= most and value > above):
        wanted = f" and above {above:g}" if above > -inf else f" and at least {least:g}" if least > -inf else ""
        wanted += f" and at most {most:g}" if most < inf else ""
        raise ValueError(f"{name} must be finite{wanted}, got {value}")


@dataclass(frozen=True)
class PolicySettings:
    """Policy settings that may differ between training and deployment (paper table "policycfg").

    Raises:
        ValueError: a row without seven finite values, a scale or rate not positive, noise below zero, or a torque
            limit outside (0, 1].
    """

    nominal: Row
    """Targets at action zero."""
    scale: Row
    """Change of the target from action 0 to 1."""
    noise: Row = (0.0,) * CHANNELS
    """Half width of the uniform noise added to each measured value."""
    control_rate_hz: float = 20.0
    torque_limit: float | None = None
    """Torque limit of every servo, fraction of its stall torque; None for the firmware's limit."""

    def __post_init__(self) -> None:
        for name in ("nominal", "scale", "noise"):
            row = getattr(self, name)
            if len(row) != CHANNELS:
                raise ValueError(f"{name} needs {CHANNELS} values in command order, got {len(row)}")
            for value in row:
                checked_number(name, value, **_RANGES[name])
        checked_number("control_rate_hz", self.control_rate_hz, least=RATE_HZ[0], most=RATE_HZ[1])
        if self.torque_limit is not None and not 0 < self.torque_limit <= 1:
            raise ValueError(f"a torque limit is a share of the stall torque in (0, 1], got {self.torque_limit}")

    @property
    def period_s(self) -> float:
        """Control period, s."""
        return 1.0 / self.control_rate_hz


PAPER_TRAINING = PolicySettings(
    nominal=(0.09, 0.09, 0.09, 0.09, 0.75, 0.035, 0.1),
    scale=(0.02, 0.02, 0.02, 0.02, 0.7, 0.003, 0.012),
    noise=(0.005, 0.005, 0.005, 0.005, 0.05, 0.005, 0.005),
)
"""Settings of the paper's training, eqs. (obs) and (action)."""

PAPER_DEPLOYMENT = PolicySettings(
    nominal=(0.083, 0.082, 0.082, 0.086, 0.75, 0.035, 0.1),
    scale=(0.026, 0.026, 0.026, 0.024, 0.7, 0.003, 0.012),
)
"""Deployment settings: paper table "policycfg"; finger values from the official ROS 2 node `rl_z_rotation_deploy`."""

PRESETS = {"training": PAPER_TRAINING, "deployment": PAPER_DEPLOYMENT}
