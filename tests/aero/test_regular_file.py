"""What is read from users' files is finite, of bounded depth and of bounded size."""

import pytest

from aero.regular_file import MIB, read_json, read_toml


@pytest.mark.parametrize("text", ["NaN", "[Infinity]", "[-Infinity]", "[1e999]", "[" * 100_000, "{", ""])
def test_json_is_finite_and_of_bounded_depth(tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(ValueError, match=r".+"):
        read_json(tmp_path / "a.json")


@pytest.mark.parametrize("text", ["a = ", "a = " + "[" * 100_000, "a = {" * 10_000])
def test_toml_is_of_bounded_depth(tmp_path, text):
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(ValueError, match=r".+"):
        read_toml(tmp_path / "a.toml")


@pytest.mark.parametrize("read", [read_json, read_toml])
def test_a_large_file_is_refused_before_it_is_read(tmp_path, read):
    with (tmp_path / "large").open("wb") as file:
        file.truncate(MIB + 1)
    with pytest.raises(OSError, match="bytes"):
        read(tmp_path / "large")
