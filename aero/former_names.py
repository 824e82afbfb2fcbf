"""Former names of keyword arguments, accepted with a warning for one release."""

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


def renamed(**names: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Return a decorator that accepts former keywords, given as `former="present"`."""

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> T:
            given: dict[str, Any] = dict(kwargs)
            for former, present in names.items():
                if former in given:
                    said = f"{function.__qualname__}({former}=...) is now {function.__qualname__}({present}=...)"
                    warnings.warn(said, DeprecationWarning, stacklevel=2)
                    given[present] = given.pop(former)
            return function(*args, **given)

        return call

    return decorate
