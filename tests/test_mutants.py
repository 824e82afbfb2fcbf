"""The mutation sample: its changes are programs, and a seed draws the same ones again."""

import ast
import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
_spec = importlib.util.spec_from_file_location("mutants", ROOT / "tests" / "mutants.py")
mutants = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(mutants)


@pytest.fixture(autouse=True)
def one_package(monkeypatch):
    monkeypatch.setattr(mutants, "PACKAGES", ("aero",))


def test_each_change_is_another_program():
    for mutant in mutants.drawn(28, seed=1):
        source = (ROOT / mutant.path).read_bytes()
        changed = source[: mutant.start] + mutant.new.encode() + source[mutant.end :]
        assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse(source)), mutant


def test_a_seed_draws_the_same_of_each_kind():
    sample = mutants.drawn(8, seed=1)
    assert sample == mutants.drawn(8, seed=1) != mutants.drawn(8, seed=2)
    assert {mutant.kind for mutant in sample} == set(mutants.KINDS)


def test_the_mirror_of_a_module_comes_first():
    assert mutants.chosen(ROOT / "firmware_emulator/kernel.py", 1) == ["tests/firmware_emulator/test_kernel.py"]


def test_words_and_annotations_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    path = tmp_path / "m.py"
    path.write_text('"""Doc 1."""\nfrom a import b\ndef f(x: 3 = b) -> 4:\n    assert x, 5\n    raise E(f"{x + 6}")\n')
    assert mutants.mutants_of(path) == []
