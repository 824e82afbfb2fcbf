"""The documents name checks, commands and files that exist."""

import re
from pathlib import Path

import click
import pytest

from hil.cli import main
from hil.cli.command_table import commands

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
TEXTS = {page: page.read_text(encoding="utf-8") for page in PAGES}
on_each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)


@on_each_page
def test_every_command_and_every_file_that_is_named_exists(page):
    assert set(re.findall(r"`aero-hil ([a-z][\w-]*)", TEXTS[page])) <= commands().keys()
    for name in re.findall(r"`((?:\w+/)+\w+\.(?:py|toml|npz|csv|png))`", TEXTS[page]):
        assert (ROOT / name).exists(), name
    folder = page.parent
    for name in re.findall(r"\]\(([^)#:]+)(?:#[\w-]*)?\)", TEXTS[page]):
        assert (folder / name).exists() or name.startswith("reference/"), name


@on_each_page
def test_every_command_that_is_shown_has_these_options(page):
    for block in re.findall(r"^```(?:sh)?\n(.*?)^```", TEXTS[page], re.S | re.M):
        parts = [part.partition("#")[0].strip() for line in block.splitlines() for part in re.split(r"&&|;", line)]
        for line in (part for part in parts if part.startswith("aero-hil ")):
            _, name, *words = line.split()
            if name == "servos":  # of feetech_robots, a distribution of its own
                continue
            command = main.get_command(click.Context(main), name)
            assert command is not None, line
            if isinstance(command, click.Group):
                command = command.get_command(click.Context(command), words[0])
                assert command is not None, line
            known = {option for parameter in command.params for option in parameter.opts + parameter.secondary_opts}
            assert {word.partition("=")[0] for word in words if word.startswith("--")} <= known | {"--help"}, line
