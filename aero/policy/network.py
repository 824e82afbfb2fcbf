"""Policy network in NumPy: normaliser, swish layers, tanh of the mean.

Equal to the deterministic Brax policy (`brax.training.agents.ppo`, `NormalTanhDistribution.mode`) for every observation
within `NORMALISED_BOUND` standard deviations.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.policy.task import ACTION_SIZE, OBSERVATION_SIZE

Floats32 = NDArray[np.float32]

NORMALISED_BOUND = 1e3
"""Saturation of observations against overflow, standard deviations from the mean; far beyond real observations."""
ACTION_BOUND = float(np.nextafter(np.float32(1), np.float32(0)))
"""Largest action, below 1; tanh alone rounds to 1 for large means."""


@dataclass(frozen=True)
class Layer:
    """One affine layer."""

    kernel: Floats32
    """Weights, (inputs, outputs)."""
    bias: Floats32
    """Offsets, (outputs,)."""

    def __post_init__(self) -> None:
        _freeze(self, "kernel", "bias")


@dataclass(frozen=True)
class Network:
    """Deterministic policy: 14 observations to 7 actions, with read-only copies of its arrays.

    Raises:
        ValueError: layers not chaining from 14 to 14, values not finite, or a standard deviation not positive.
    """

    mean: Floats32
    """Mean of the observations, (14,)."""
    std: Floats32
    """Standard deviation of the observations, (14,), positive."""
    layers: tuple[Layer, ...]
    """All layers; the last one outputs 7 means, and 7 raw exploration scales that are ignored."""

    def __post_init__(self) -> None:
        _freeze(self, "mean", "std")
        widths = [OBSERVATION_SIZE, *(layer.kernel.shape[-1] for layer in self.layers)]
        if not self.layers or widths[-1] != 2 * ACTION_SIZE:
            raise ValueError(f"the last layer must have {2 * ACTION_SIZE} outputs (means and scales), got {widths[-1]}")
        expected: dict[str, tuple[int, ...]] = {"mean": (OBSERVATION_SIZE,), "std": (OBSERVATION_SIZE,)}
        arrays = {"mean": self.mean, "std": self.std}
        for i, layer in enumerate(self.layers):
            expected |= {f"kernel_{i}": (widths[i], widths[i + 1]), f"bias_{i}": (widths[i + 1],)}
            arrays |= {f"kernel_{i}": layer.kernel, f"bias_{i}": layer.bias}
        for name, array in arrays.items():
            if array.shape != expected[name]:
                raise ValueError(f"{name} must be {expected[name]} to fit its neighbours, got {array.shape}")
            if not np.all(np.isfinite(array)):
                raise ValueError(f"{name} holds values that are not finite")
        if np.min(self.std) <= 0:
            raise ValueError("every standard deviation of the normaliser must be positive")

    def act(self, observation: ArrayLike) -> Floats32:
        """Return the action for one observation or a batch.

        Args:
            observation: (..., 14), m, rad and actions, in the layout of `aero.policy.task.observe`.

        Returns:
            (..., 7) in command order, inside (-1, 1).

        Raises:
            ValueError: last axis not of length 14, or a value not finite.
        """
        x = np.asarray(observation, dtype=np.float64)
        if x.shape[-1:] != (OBSERVATION_SIZE,):
            raise ValueError(f"an observation is (..., {OBSERVATION_SIZE}), got {x.shape}")
        if not np.all(np.isfinite(x)):
            raise ValueError(f"an observation must be finite, got {x}")
        reach = NORMALISED_BOUND * self.std
        hidden: Floats32 = ((np.clip(x, self.mean - reach, self.mean + reach) - self.mean) / self.std).astype(
            np.float32
        )
        for layer in self.layers[:-1]:
            hidden = swish(hidden @ layer.kernel + layer.bias)
        head = hidden @ self.layers[-1].kernel + self.layers[-1].bias
        action: Floats32 = np.clip(np.tanh(head[..., :ACTION_SIZE]), -ACTION_BOUND, ACTION_BOUND)
        return action


def _freeze(holder: Layer | Network, *names: str) -> None:
    """Replace arrays of a frozen dataclass by read-only copies."""
    for name in names:
        array = np.array(getattr(holder, name))
        array.setflags(write=False)
        object.__setattr__(holder, name, array)


def swish(x: Floats32) -> Floats32:
    """Return `x * sigmoid(x)`, written with tanh so that large values do not overflow."""
    half: Floats32 = np.float32(0.5) * x
    ramp: Floats32 = half + half * np.tanh(half)
    return ramp
