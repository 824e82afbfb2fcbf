"""A header whose values do not fit its fields is refused in one line that names the field."""

import dataclasses

import pytest

from hil.recordings import mcap_file
from hil.recordings.errors import UnusableFileError
from hil.recordings.mcap_file import RecordingFile, read_header, read_recording
from hil.recordings.recording import Header

HEADER = Header("audit", "emulated", "right", "0.2.0", "fit", "homed", "reference", 0, {"n": 3, "step": 0.5, "to": "x"})


@pytest.fixture
def written(tmp_path, monkeypatch):
    def write(**changed):
        content = dataclasses.asdict(HEADER) | changed
        monkeypatch.setattr(mcap_file.dataclasses, "asdict", lambda _header: content)
        RecordingFile(tmp_path / "run.mcap", HEADER).finish(HEADER)
        return tmp_path / "run.mcap"

    return write


def test_a_header_is_read_as_written(written):
    assert repr(read_header(written())) == repr(read_recording(written()).header) == repr(HEADER)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("hand", "middle"), ("seed", -1), ("seed", 1.5), ("duration_s", float("nan")), ("duration_s", 1e16),
        ("parameters", {"a": [1]}), ("parameters", {"a": float("inf")}), ("safety", {"current_a": "3"}),
        ("versions", {"numpy": 2}), ("started", "9999-12-31T00:00:00+00:00"), ("finished", 1), ("later", "x"),
    ],
)  # fmt: skip
def test_a_value_that_no_header_has_is_named(field, value, written):
    with pytest.raises(UnusableFileError, match=rf"its header.*\b{field}"):
        read_recording(written(**{field: value}))
