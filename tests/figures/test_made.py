"""What ships and every table of figures is up to date: made from the present inputs, or a sample of it remade is equal.

`python -m figures --sample` in the environment of `tox -e figures` remakes the samples of what is named here.
"""

from pathlib import Path

import pytest
from figures import made
from figures.inputs import ROOT, changed, closure, digest
from figures.made import everything
from figures.results import Shipped, Stored, load, names, store


@pytest.mark.parametrize("name", names())
def test_it_is_up_to_date(name):
    stored = load(name)
    assert stored.inputs
    assert not stored.stale, f"{name} is out of date: {', '.join(stored.stale)} changed since its sample was remade"
    if stored.differs:
        pytest.xfail(f"{name} is out of date: {stored.differs}")


def test_all_that_is_made_is_stored():
    assert sorted(everything()) == names()


def test_everything_that_ships_as_data_is_made():
    made_files = {name for one in everything().values() for name in one.by.files}
    by_hand = {"hil/data/steps.toml", "aero/actuation/coefficients/paper.toml", "aero/policy/shipped/steady.toml"}
    folders = [ROOT / name for name in ("hil/data", "aero/policy/shipped", "aero/actuation/coefficients")]
    data = {path for folder in folders for path in folder.iterdir() if path.suffix in {".toml", ".csv", ".npz"}}
    assert {path.relative_to(ROOT).as_posix() for path in data} - by_hand <= made_files


@pytest.mark.parametrize(
    ("module", "input_"),
    [
        ("figures.policy", "model/softness.py"),
        ("figures.policy", "simulator/scene.py"),
        ("figures.limits", "model/softness.py"),
        ("figures.limits", "aero/safety/thresholds.py"),
        ("figures.correction", "model/softness.py"),
    ],
)
def test_what_a_number_depends_on_is_an_input(module, input_):
    (of_module,) = {one.by.maker for one in made.of_module(module.partition(".")[2]).values()}
    assert ROOT / input_ in closure((module, *of_module))


def test_an_output_is_no_input():
    assert not {name for name in names() if set(load(name).inputs) & set(load(name).outputs)}


SOURCE = '''"""Old words."""


def f():
    """Old."""
    return 1.5  # why
'''


@pytest.mark.parametrize(
    ("name", "before", "after", "same"),
    [
        ("a.py", SOURCE, SOURCE.replace("Old", "New").replace("  # why", ""), True),
        ("a.py", SOURCE, SOURCE.replace("1.5", "(1.5)"), True),
        ("a.py", SOURCE, SOURCE.replace("1.5", "1.6"), False),
        ("a.py", "a = ['', 1]", "a = [1]", False),
        ("a.toml", "a = 1 # old\n", "a = 1\n", True),
        ("a.toml", "a = 1\n", "a = 2\n", False),
        ("a.csv", "1\n", "1\r\n", True),
        ("a.csv", "1\n", "2\n", False),
    ],
)
def test_words_have_no_meaning_and_numbers_have(tmp_path, name, before, after, same):
    found = []
    for folder, text in (("before", before), ("after", after)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / name).write_text(text, newline="")
        found.append(digest(tmp_path / folder / name))
    assert (found[0] == found[1]) is same


def test_a_changed_and_a_missing_input_are_named(tmp_path):
    (tmp_path / "a.toml").write_text("a = 1")
    noted = {"a.toml": digest(tmp_path / "a.toml"), "b.toml": "00000000"}
    assert changed(noted, tmp_path) == ["b.toml"]
    digest.cache_clear()
    (tmp_path / "a.toml").write_text("a = 2")
    assert changed(noted, tmp_path) == ["a.toml", "b.toml"]


def test_what_is_stored_is_read_as_it_was_written(tmp_path, monkeypatch):
    monkeypatch.setattr("figures.results.STORED", tmp_path)
    one = Stored("`make`", [["a", "b"], ["1", "ü"]], [["c"]], "4.0", "", {"x/y.csv": "0123"}, {"z.py": "4567"})
    store("one", one)
    assert load("one") == one


@pytest.mark.parametrize(
    ("stored", "said"),
    [
        ([["a"], ["1.0"]], ""),
        ([["a"], ["2.0"]], "1 of 1 rows differ; stored no such row; measured 1.0"),
        ((), "no sample was stored when it was made"),
    ],
)
def test_a_sample_is_compared_with_the_stored_one(monkeypatch, stored, said):
    one = made.Made(Shipped((), (), lambda: [["a"], ["1.0"]]))
    monkeypatch.setattr(made, "everything", lambda: {"one": one})
    assert made.difference("one", Stored("", sample=stored, mujoco=made.MUJOCO), one.by.sample()) == said


def test_an_import_inside_a_function_is_an_input():
    found = {path.relative_to(ROOT).as_posix() for path in closure(["figures.policy"])}
    assert {"train/trainer.py", "train/__init__.py", "docs/figures/policy.py"} <= found
    assert not any(Path(name).is_absolute() for name in found)
