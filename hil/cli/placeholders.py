"""Placeholders for packages that are not installed: enough to import a command for its `--help`, and no more."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any


class _Anything(type):
    """A class that can be called, subscripted and derived from, and whose attributes are it."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return cls

    def __call__(cls, *given: Any, **named: Any) -> Any:
        return cls if cls is _Placeholder else super().__call__(*given, **named)

    def __getitem__(cls, key: object) -> Any:
        return cls

    def __iter__(cls) -> Iterator[Any]:
        return iter(())

    def __mro_entries__(cls, bases: tuple[type, ...]) -> tuple[type, ...]:
        return (object,)


class _Placeholder(metaclass=_Anything):
    pass


class _Module(ModuleType):
    __version__ = "0"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _Placeholder


class _Finder(MetaPathFinder, Loader):
    """Finds any module that nothing else finds, but for those of some packages."""

    def __init__(self, ours: Sequence[str]) -> None:
        self.ours = ours

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        # The standard library looks for modules of other systems.
        known = name.partition(".")[0] in (*self.ours, *sys.stdlib_module_names)
        return None if known else ModuleSpec(name, self, is_package=True)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _Module(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        pass


@contextmanager
def placeholders(ours: Sequence[str]) -> Iterator[None]:
    """Let packages that are not installed be imported, but for `ours`; for a program that ends after its help."""
    finder = _Finder(ours)
    sys.meta_path.append(finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
