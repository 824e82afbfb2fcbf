"""Names of keyword arguments, checked with a suggestion."""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import ParamSpec, TypeVar

from aero_hil_toml import meant

P = ParamSpec("P")
T = TypeVar("T")


def suggesting(function: Callable[P, T]) -> Callable[P, T]:
    """Return a function that answers a misspelt keyword argument with the name that was meant, and all names."""
    known = signature(function).parameters

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        if unknown := next((name for name in kwargs if name not in known), None):
            said = (
                f"{function.__name__}() has no argument {unknown!r}; {meant(unknown, known)}it takes {', '.join(known)}"
            )
            raise TypeError(said)
        return function(*args, **kwargs)

    return call
