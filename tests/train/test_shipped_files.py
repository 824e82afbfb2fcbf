"""What ships is tied to a command, to a commit that exists and to inputs that have not changed since."""

import json
import re
import subprocess
import tomllib
from hashlib import sha256
from pathlib import Path

import pytest

from aero.policy.shipped import find_policy
from train.recipe import STEADY
from train.shipped import ROOT, Artefact, NoHistoryError, exists, load, made, meaning, problems, store

ARTEFACTS = load()
FIGURES = sorted((ROOT / "docs" / "figures" / "stored").glob("*.json"))
COMMIT = re.compile(r"\b(?=[0-9a-f]*[0-9])[0-9a-f]{7,12}\b")


@pytest.fixture(scope="module", autouse=True)
def history():
    try:
        exists("HEAD")
    except NoHistoryError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("artefact", ARTEFACTS, ids=lambda one: one.files[0])
def test_an_artefact_is_up_to_date_or_says_why(artefact):
    """Make it anew, then `python -m train.shipped --made FILE`; or give the reason with `--reason`."""
    assert list(problems(artefact)) == []
    assert artefact.command


def test_everything_that_was_made_is_listed():
    listed = {name for artefact in ARTEFACTS for name in artefact.files}
    folders = {"hil/data": {"steps.toml"}, "aero/policy/shipped": set(), "aero/actuation/coefficients": {"paper.toml"}}
    for folder, written in folders.items():
        files = {path for path in (ROOT / folder).iterdir() if path.suffix in {".toml", ".csv", ".npz"}}
        assert {f"{folder}/{path.name}" for path in files if path.name not in written} <= listed


def test_the_limits_are_of_the_commit_that_their_population_names():
    population = tomllib.loads((ROOT / "hil/data/population.toml").read_text(encoding="utf-8"))
    (limits,) = (one for one in ARTEFACTS if "hil/data/limits.csv" in one.files)
    assert limits.commit in (population.get("commit"), *population.get("commits", ()))


def test_the_weights_are_of_the_recipe():
    provenance = find_policy("steady").provenance
    assert provenance["recipe_sha256"] == STEADY.last_stage().fingerprint
    assert provenance["from_sha256"] == sha256((ROOT / "docs/training/steady_start.npz").read_bytes()).hexdigest()
    assert exists(provenance["commit"])


@pytest.mark.parametrize("path", FIGURES, ids=lambda path: path.stem)
def test_a_stored_figure_names_commits_that_exist(path):
    named = COMMIT.findall(json.loads(path.read_text(encoding="utf-8"))["origin"])
    assert [commit for commit in named if not exists(commit)] == []


def test_prose_is_no_change_and_a_number_is():
    before = b'"""Old words."""\n\n\ndef f():\n    """Old."""\n    return 1.5  # why\n'
    prose = b'"""New words."""\n\ndef f():\n    """New."""\n    return 1.5\n'
    assert meaning("f.py", before) == meaning("f.py", prose)
    assert meaning("f.py", before) == meaning("f.py", b"from __future__ import annotations\n" + prose)
    assert meaning("f.py", before) != meaning("f.py", before.replace(b"1.5", b"1.6"))
    assert meaning("f.toml", b"a = 1 # old\n") == meaning("f.toml", b"a = 1\n") != meaning("f.toml", b"a = 2\n")
    assert meaning("f.csv", b"1\n") != meaning("f.csv", b"2\n")


def git(folder, *arguments):
    identity = ("-c", "user.name=a", "-c", "user.email=a@b")
    done = subprocess.run(("git", "-C", folder, *identity, *arguments), check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def repository(tmp_path: Path):
    git(tmp_path, "init", "-q")
    (tmp_path / "model.toml").write_text("mass = 1.0\n")
    (tmp_path / "table.csv").write_text("made\n")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "first")
    return tmp_path


def test_a_changed_number_puts_out_of_date_what_was_made_from_it(repository):
    artefact = Artefact(("table.csv",), "make it", git(repository, "rev-parse", "HEAD"), ("model.toml",))
    assert list(problems(artefact, repository)) == []
    (repository / "model.toml").write_text("mass = 1.1\n")
    (problem,) = problems(artefact, repository)
    assert problem.startswith("table.csv is out of date: model.toml changed since")
    git(repository, "commit", "-qam", "second")
    (explained,) = made((artefact,), "table.csv", "no table reads it", repository)
    (both,) = made((explained,), "table.csv", "a name changed", repository)
    assert both.reason == "no table reads it; a name changed"
    (as_before,) = made((both,), "table.csv", "a name changed", repository)
    assert as_before.reason == both.reason
    assert list(problems(explained, repository)) == []
    (again,) = made((explained,), "table.csv", root=repository)
    assert (list(problems(again, repository)), again.reason) == ([], "")


def test_a_commit_that_is_not_in_the_history_is_a_problem(repository):
    (problem,) = problems(Artefact(("table.csv",), "make it", "8b2b055cbf7b", ("model.toml",)), repository)
    assert "commit 8b2b055cbf7b is not in the history" in problem


def test_a_table_is_read_as_it_was_written(tmp_path):
    store(ARTEFACTS, tmp_path / "shipped.toml")
    assert load(tmp_path / "shipped.toml") == ARTEFACTS


def test_a_file_that_is_not_listed_is_refused():
    with pytest.raises(ValueError, match=r"nothing\.csv is not listed; listed are "):
        made(ARTEFACTS, "nothing.csv")
