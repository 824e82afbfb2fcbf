"""What other packages bring to the instrument, by entry points."""

import logging
from collections.abc import Iterator
from importlib.metadata import EntryPoint, distributions
from typing import Any

_LOG = logging.getLogger(__name__)


def points_of(group: str) -> Iterator[tuple[str, EntryPoint]]:
    """Yield each entry point of a group with the name of its distribution; an unreadable distribution is left out."""
    for found in distributions():
        try:
            points = found.entry_points.select(group=group)
            name = found.metadata["Name"] if points else ""
        except Exception as error:  # whatever metadata another package has, ours go on
            _LOG.info("an installed package is unreadable: %s", error)
            continue
        if name:
            yield from ((name, point) for point in points)


def brought(group: str) -> Iterator[tuple[str, Any]]:
    """Yield the name of each distribution with an object that it brings; a broken one is left out with a line."""
    for name, point in points_of(group):
        try:
            found = point.load()
        except Exception as error:  # whatever a module of another package raises
            leave_out(name, point.name, error)
            continue
        yield name, found


def leave_out(package: str, what: str, error: Exception | str) -> None:
    """Log that something of another package is not used."""
    _LOG.warning("`%s` of the package `%s` is left out: %s", what, package, error)
