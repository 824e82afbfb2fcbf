"""Python, this project's version, and which extras are usable, from what the installed package says about itself."""

from __future__ import annotations

import platform
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from typing import NamedTuple

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

from hil.recordings.provenance import source_commit
from hil.robots.finding import Examined, Verdict

PROJECT = "aero-hil"
INSTALL = "pip install '{project}[{extra}]', or from a checkout pip install -e '.[{extra}]'"

RequiresOf = Callable[[str], Sequence[str]]
"""The requirements that an installed package declares, by its name; none when it is not installed."""
VersionOf = Callable[[str], str | None]
"""The version of an installed package, None when it is not installed."""


class Need(NamedTuple):
    """One package that something needs."""

    name: str
    wanted: str
    """Range of versions, empty for any."""
    installed: str | None

    @property
    def fits(self) -> bool:
        """Whether it is installed in a version of the range."""
        return self.installed is not None and SpecifierSet(self.wanted).contains(self.installed, prereleases=True)

    def __str__(self) -> str:
        return f"{self.name} {self.installed}, wanted {self.wanted}" if self.installed else self.name


@dataclass(frozen=True)
class Needs:
    """What the project, or one extra of it, needs."""

    packages: tuple[Need, ...]

    @property
    def lacking(self) -> tuple[Need, ...]:
        """What is not installed."""
        return tuple(need for need in self.packages if need.installed is None)

    @property
    def unfit(self) -> tuple[Need, ...]:
        """What is installed in a version that was not tested."""
        return tuple(need for need in self.packages if need.installed is not None and not need.fits)

    @property
    def usable(self) -> bool:
        """Whether everything is there as it should be."""
        return all(need.fits for need in self.packages)


def needs(extra: str, requires_of: RequiresOf, version_of: VersionOf) -> Needs:
    """Return what an extra needs beyond the project's own dependencies; those themselves for the name ``."""
    found = {need.name: need for need in _walk(PROJECT, extra, requires_of, version_of)}
    return Needs(tuple(sorted(found.values())))


def _walk(package: str, extra: str, requires_of: RequiresOf, version_of: VersionOf) -> Iterator[Need]:
    """Follow extras that name extras, of this project or of others."""
    for line in requires_of(package):
        requirement = Requirement(line)
        marker = requirement.marker
        always = marker is None or marker.evaluate({"extra": ""})
        if always == bool(extra) or not (marker is None or marker.evaluate({"extra": extra})):
            continue
        name = canonicalize_name(requirement.name)
        if name != PROJECT:
            yield Need(name, str(requirement.specifier), version_of(name))
        for further in requirement.extras:
            yield from _walk(name, further, requires_of, version_of)


def installed_version(name: str) -> str | None:
    """Return the version of an installed package, None when it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def declared(name: str) -> Sequence[str]:
    """Return the requirements of an installed package, none when it is not installed."""
    try:
        return requires(name) or ()
    except PackageNotFoundError:
        return ()


def check_python() -> Examined:
    """Look at Python and the platform."""
    found = f"{platform.python_version()} on {platform.system()} {platform.release()}, {platform.machine()}"
    data = {"version": platform.python_version(), "system": platform.system(), "machine": platform.machine()}
    try:
        wanted = metadata(PROJECT)["Requires-Python"] or ""
    except PackageNotFoundError:
        wanted = ""
    if SpecifierSet(wanted).contains(platform.python_version(), prereleases=True):
        return Examined("python", Verdict.OK, found, data=data)
    remedy = f"{PROJECT} wants Python {wanted}; make a virtual environment with one"
    return Examined("python", Verdict.WRONG, found, remedy, data=data)


def check_version() -> Examined:
    """Look at this project: its version and its commit."""
    installed, commit = installed_version(PROJECT), source_commit()
    data = {"version": installed, "commit": commit}
    if installed is None:
        remedy = "from its folder: pip install -e . in a virtual environment"
        return Examined(PROJECT, Verdict.WRONG, "it runs, but is not installed", remedy, data=data)
    return Examined(PROJECT, Verdict.OK, f"{installed}, commit {commit or 'not known'}", data=data)


def check_packages(base: Needs) -> Examined:
    """Look at the packages that everything needs."""
    data = {need.name: need.installed for need in base.packages}
    if base.usable:
        found = ", ".join(f"{need.name} {need.installed}" for need in base.packages)
        return Examined("packages", Verdict.OK, found or "nothing is declared", data=data)
    found = "; ".join(map(str, (*base.lacking, *base.unfit)))
    remedy = f"install it again, in a virtual environment of its own: pip install --upgrade {PROJECT}"
    return Examined(
        "packages", Verdict.WRONG, f"missing or in a version that was not tested: {found}", remedy, data=data
    )


def check_extras(extras: dict[str, Needs]) -> Iterator[Examined]:
    """Look at the extras: those that are usable, and one line for each that is there but not as it was tested.

    An extra of which something is missing was not asked for, and is no fault.
    """
    usable = [name for name, extra in extras.items() if extra.usable]
    lacking = {name: extra for name, extra in extras.items() if extra.lacking}
    found = f"usable: {', '.join(usable) or 'none'}"
    if lacking:
        found += f"; not installed: {', '.join(lacking)}"
    data = {
        name: {"usable": extra.usable, "packages": {need.name: need.installed for need in extra.packages}}
        for name, extra in extras.items()
    }
    remedy = f"for one of the others: {INSTALL.format(project=PROJECT, extra='NAME')}" if lacking else ""
    yield Examined("extras", Verdict.OK, found, remedy, data=data)
    for name, extra in extras.items():
        if extra.unfit and not extra.lacking:
            unfit = "; ".join(map(str, extra.unfit))
            yield Examined(f"extra {name}", Verdict.LOOK, unfit, INSTALL.format(project=PROJECT, extra=name))


def check_installation() -> Iterator[Examined]:
    """Look at all of this."""
    yield check_python()
    yield check_version()
    if installed_version(PROJECT) is None:
        return
    yield check_packages(needs("", declared, installed_version))
    names = metadata(PROJECT).get_all("Provides-Extra") or []
    yield from check_extras({name: needs(name, declared, installed_version) for name in sorted(names)})
