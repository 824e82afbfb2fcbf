"""Options of a pytest plugin that yield to the project's own options of equal name."""

from argparse import SUPPRESS
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest


@dataclass(frozen=True)
class PluginOptions:
    """Options of one plugin: always `--aero-NAME`, and `--NAME` unless the project defines that option."""

    group: str
    """Name of the option group in pytest's help."""
    title: str
    options: Mapping[str, Mapping[str, Any]]
    """Arguments of `addoption` by name; `bus-driver` becomes `config.option.aero_bus_driver`."""
    taken: pytest.StashKey[list[str]]
    """Stash key of the names defined by the project."""

    def add(self, parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
        """Add the long names, and the short ones if the project's conftest files are already loaded."""
        group = parser.getgroup(self.group, self.title)
        for name, settings in self.options.items():
            group.addoption(f"--aero-{name}", dest=_dest(name), **{**settings, "help": SUPPRESS})
        # A plugin named in a conftest's `pytest_plugins` is registered after the conftest's own options and after the
        # hook that calls `add_short_names`.
        files = (Path(getattr(plugin, "__file__", None) or "") for plugin in pluginmanager.get_plugins())
        if any(file.name == "conftest.py" for file in files):
            config = pluginmanager.get_plugin("pytestconfig")
            assert isinstance(config, pytest.Config)
            self.add_short_names(parser, config)

    def add_short_names(self, parser: pytest.Parser, config: pytest.Config) -> None:
        """Add, once, each short name not defined by the project; call after its conftest files are loaded."""
        if self.taken in config.stash:
            return
        config.stash[self.taken] = [name for name in self.options if _is_known(parser, f"--{name}")]
        for name, settings in self.options.items():
            if name not in config.stash[self.taken]:
                parser.getgroup(self.group).addoption(f"--{name}", dest=_dest(name), **settings)

    def header(self, config: pytest.Config) -> list[str]:
        """Return a line naming the options defined by the project; empty without any."""
        if not (taken := config.stash.get(self.taken, [])):
            return []
        theirs, ours = (", ".join(f"{dashes}{name}" for name in taken) for dashes in ("--", "--aero-"))
        return [f"{self.group}: {theirs} is this project's own; {self.group}'s is {ours}"]


def _is_known(parser: pytest.Parser, option: str) -> bool:
    try:
        return option not in parser.parse_known_and_unknown_args([option])[1]
    except pytest.UsageError:  # it takes a value
        return True


def _dest(name: str) -> str:
    return f"aero_{name.replace('-', '_')}"
