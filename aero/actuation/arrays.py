"""Array checks for the map's stages, on NumPy, in a JAX trace or on any array that follows the array API.

The stages use products and sums of columns instead of matrix products. This is as fast at these sizes, reads like the
paper's equations, and keeps full single precision where a GPU would multiply matrices in a shorter format.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.protocol import MAX_CODE

Array = Any
"""An array of floats or integers: NumPy's, JAX's (also while tracing), or another that follows the array API."""
SINGLE_BITS = 32
"""Width of single precision, bits; a narrower float cannot represent codes up to 65535."""


def namespace(array: Array) -> Any:
    """Return the module whose functions take `array`."""
    return array.__array_namespace__()


def as_floats(values: Array, width: int, what: str) -> Array:
    """Return `values` as an array of floats with `width` entries on the last axis.

    Half precision is widened to single, because its largest number is below the largest code.

    Raises:
        ValueError: not real numbers, or another width.
    """
    array = values if hasattr(values, "__array_namespace__") else np.asarray(values)
    xp = namespace(array)
    if xp.isdtype(array.dtype, "integral"):
        array = xp.astype(array, xp.asarray(0.0).dtype)
    elif not xp.isdtype(array.dtype, "real floating"):
        raise ValueError(f"{what}: expected real numbers, got {array.dtype}")
    elif xp.finfo(array.dtype).bits < SINGLE_BITS:
        array = xp.astype(array, xp.float32)
    return _of_width(array, width, what)


def as_finite(values: Array, width: int, what: str) -> Array:
    """Return `values` as `as_floats` does, and require a NumPy array to be finite; a JAX trace cannot raise.

    Raises:
        ValueError: as `as_floats`, or NaN or infinity.
    """
    array = as_floats(values, width, what)
    if isinstance(array, np.ndarray) and not np.isfinite(array).all():
        raise ValueError(f"{what}: expected finite numbers, got {array.tolist()}")
    return array


def as_codes(values: Array, width: int, what: str) -> Array:
    """Return `values` as an array of integers in 0..65535 with `width` entries on the last axis.

    Raises:
        ValueError: not integers, another width, or, for NumPy arrays, out of range.
    """
    array = values if hasattr(values, "__array_namespace__") else np.asarray(values)
    _of_width(array, width, what)
    if not namespace(array).isdtype(array.dtype, "integral"):
        raise ValueError(f"{what}: expected integers in 0..{MAX_CODE}, got {array.dtype}")
    if isinstance(array, np.ndarray) and array.size and not (array.min() >= 0 and array.max() <= MAX_CODE):
        raise ValueError(f"{what}: expected 0..{MAX_CODE}, got {array.min()}..{array.max()}")
    return array


def whole_numbers(values: ArrayLike, width: int | None, lowest: int, highest: int, what: str) -> NDArray[np.int64]:
    """Return a copy of whole numbers in `lowest`..`highest`, with `width` entries on the last axis (None: any shape).

    Raises:
        ValueError: not integers, out of range, or another shape.
    """
    array = np.array(values)
    if width is not None:
        _of_width(array, width, what)
    whole = array.dtype.kind in "iu" or (array.dtype.kind == "f" and bool((array == np.rint(array)).all()))
    if not whole:
        raise ValueError(f"{what}: expected integers in {lowest}..{highest}, got {array.dtype} {array.tolist()}")
    if array.size and not (array.min() >= lowest and array.max() <= highest):
        raise ValueError(f"{what}: expected {lowest}..{highest}, got {array.min()}..{array.max()}")
    return array.astype(np.int64)


def _of_width(array: Array, width: int, what: str) -> Array:
    if array.ndim == 0 or array.shape[-1] != width:
        raise ValueError(f"{what}: expected shape (..., {width}), got {tuple(array.shape)}")
    return array
