"""The Dockerfile names only what there is; whether it builds is for a machine with Docker."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_extra_that_it_installs_and_the_command_that_it_starts_exist():
    (extra,) = re.findall(r'"/project\[(\w+)\]"', DOCKERFILE)
    assert extra in PROJECT["optional-dependencies"]
    (command,) = re.findall(r'ENTRYPOINT \["([\w-]+)"\]', DOCKERFILE)
    assert command in PROJECT["scripts"]
