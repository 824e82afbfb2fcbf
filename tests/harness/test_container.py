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


def test_its_python_is_one_that_the_project_runs_on_and_the_suite_is_where_it_says():
    major, minor = map(int, re.findall(r"FROM python:(\d+)\.(\d+)", DOCKERFILE)[0])
    least = tuple(map(int, PROJECT["requires-python"].removeprefix(">=").split(".")))
    assert (major, minor) >= least
    for path in re.findall(r"/project/([\w/]+)", DOCKERFILE):
        assert (ROOT / path).is_dir()


def test_the_changelog_tells_of_this_version():
    assert PROJECT["version"] in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
