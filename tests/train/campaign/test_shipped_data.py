"""What ships was made by commands: hands that made it are measured again, and read the same."""

import tomllib
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import pytest

from hil.checks import CHECKS
from hil.verdict.limits import excesses, kinds, load_limits
from model.units import DEFAULT_LIMITS
from train.campaign.trial import perform
from train.limits.kept_readings import parse_kept

ROOT = Path(__file__).parents[3]
DATA = ROOT / "hil" / "data"
RECIPES = tomllib.loads((DATA / "recipes.toml").read_text(encoding="utf-8"))
LIMITS = {
    f"{kind}/{place}": (kind, hand)
    for kind in kinds()
    for place, hand in enumerate(parse_kept((DATA / "limits" / "hands" / f"{kind}.json").read_text(encoding="utf-8")))
}


def taken_with(mujoco):
    """Compare with readings that were taken with a version of MuJoCo; another moves some of them by more than that."""
    return pytest.mark.skipif(
        not version("mujoco").startswith(mujoco), reason=f"the kept readings were taken with MuJoCo {mujoco}x"
    )


LIMITS_PHYSICS = taken_with("4.0.")


def out_of_date(moved, name):
    """Say which readings moved, and how the data are made anew."""
    lines = [*moved]
    head = f"hil/data ({', '.join(RECIPES[name]['data'])}) is out of date:"
    return "\n".join([head, *lines, "Make the data anew:", *RECIPES[name]["commands"]]) if lines else ""


def measured_again(name):
    kind, hand = LIMITS[name]
    assert not (said := out_of_date(hand.moved(perform(hand.trial), CHECKS), kind)), said


@LIMITS_PHYSICS
@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(name for name in LIMITS if name.endswith("/1")))
def test_one_of_each_kind_that_made_limits_read_the_same(name):
    measured_again(name)


@pytest.mark.parametrize("name", LIMITS)
def test_limits_were_computed_from_readings_that_hold_those_of_their_hands(name):
    kind, hand = LIMITS[name]
    limits = load_limits(kind, hand.trial.firmware, guarded=hand.trial.guarded)
    found = excesses(hand.numbers, [limit for limit in limits if limit.healthy and limit.experiment in hand.numbers])
    # The population's are rounded to six figures; a kind of its own widens only the limits that it has to.
    least = 1e-3 if kind == DEFAULT_LIMITS else 1.0
    assert {key: excess for key, excess in found.items() if abs(excess) > least} == {}
    assert len(found) > 100


def test_three_hands_are_stored_of_each_kind():
    assert len(LIMITS) == 3 * len(kinds())


@pytest.mark.parametrize("name", RECIPES)
def test_a_recipe_makes_data_that_ship_from_commits_that_are_named(name):
    recipe = RECIPES[name]
    assert all((DATA / path).is_file() for path in recipe["data"])
    assert all(command.startswith("aero-hil ") for command in recipe["commands"])
    assert recipe["commits"]
    assert recipe["generator"]


def test_a_reading_that_moved_is_named():
    _, hand = LIMITS["aero_hand_open/1"]
    check = next(check for check in CHECKS if check.metric == "friction")
    subject = check.subjects[0]
    numbers = {name: {on: dict(found) for on, found in table.items()} for name, table in hand.numbers.items()}
    numbers[check.experiment][subject][check.metric] += 2 * check.floor
    (line,) = replace(hand, numbers=numbers).moved(Read(hand.numbers), CHECKS)
    assert f"{check.experiment}/{check.metric}/{subject}" in line
    assert hand.trial.key in line


class Read:
    """An outcome of which only the numbers matter."""

    stopped = ""

    def __init__(self, numbers):
        self.numbers = numbers
