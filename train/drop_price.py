"""The price of a drop as a Lagrange multiplier: dearer while cubes are dropped too often, cheaper while they are not.

A fixed price makes one gait drop and another hold still, and which one depends on the seed; the multiplier asks for a
hazard instead. A constraint on a rate in reinforcement learning: Stooke, Achiam and Abbeel 2020, "Responsive Safety in
Reinforcement Learning by PID Lagrangian Methods", its integral part.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp


@dataclass(frozen=True)
class DropPrice:
    """How the price follows the hazard."""

    begin: float = 100.0
    """Price of a drop at the beginning of the stage, in the reward's units."""
    bounds: tuple[float, float] = (60.0, 400.0)
    """Lowest and highest price."""
    hazard_per_s: float = 0.005
    """Drops a second that are asked for; with 0.5 % a second 93 % of the cubes are kept for 15 s while exploring."""
    gain: float = 0.006
    """Relative change of the price an update, for each relative excess of the hazard."""
    excess: float = 2.0
    """Bound of that relative excess, on both sides."""
    slowest_rad_s: float = 0.15
    """Mean rate below which drops are not what is wrong, and the price only falls."""
    relief: float = 0.01
    """Relative fall of the price an update while it does."""

    def after(self, price: float, *, hazard_per_s: float, rate_rad_s: float) -> float:
        """Return the price after an update, from the running means of hazard and rate."""
        over = min(max(hazard_per_s / self.hazard_per_s - 1.0, -self.excess), self.excess)
        change = self.gain * over if rate_rad_s > self.slowest_rad_s else -self.relief
        low, high = self.bounds
        return min(max(price * exp(change), low), high)


@dataclass(frozen=True)
class Tendency:
    """Running means of what the hands in training do, exploration included."""

    rate_rad_s: float = 0.0
    """Mean angular velocity of the cubes."""
    hazard_per_s: float = 0.0
    """Drops a second of one hand."""
    updates: int = 0
    """How many updates are in the means."""

    def after(self, rate_rad_s: float, hazard_per_s: float) -> Tendency:
        """Return the means after one more update."""
        share = 1.0 / min(self.updates + 1, MEMORY_UPDATES)
        return Tendency(
            self.rate_rad_s + share * (rate_rad_s - self.rate_rad_s),
            self.hazard_per_s + share * (hazard_per_s - self.hazard_per_s),
            self.updates + 1,
        )

    def kept(self, seconds: float) -> float:
        """Return the share of cubes that are kept so long at this hazard."""
        return exp(-self.hazard_per_s * seconds)


MEMORY_UPDATES = 20
"""Updates of the networks that the running means look back on."""
