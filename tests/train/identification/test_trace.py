import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import FINGERS, Channel
from aero.protocol import MAX_CODE
from hil.recordings.mcap_file import write_recording
from hil.recordings.recording import Header, Recording, Series
from train.identification.excitation import PERIOD_S, excitation
from train.identification.trace import GRID_S, Trace, closing_current_sign, load_trace, window_counts

LABELS = tuple(channel.label for channel in Channel)


def log(**changes):
    rows = np.arange(3)
    wire = np.array([1138, 1183, 2980, 3278, 3278, 3278, 3278.0])
    counts = np.outer(rows, np.arange(1, 8)) * 10.0
    fields = {
        "t_cmd": np.array([0.0, np.nan, 0.2]),
        "cmd": np.full((3, 7), 0.5),
        "t_pos": np.array([0.0, 0.1, 0.2]),
        "pos": np.floor(counts * 65535 / wire) / 65535,
        "cur_ma": np.full((3, 7), 650.0),
        "temp_c": np.full((3, 7), 30.0),
        "span_counts": wire,
    }
    return fields | changes


def write(tmp_path, fields):
    path = tmp_path / "run.npz"
    np.savez(path, **fields)
    return path


def test_npz_comes_in_command_order_and_counts_whatever_else_it_holds(tmp_path):
    trace = load_trace(write(tmp_path, log(event=np.array(["rest", "sample", "rest"]))))
    assert trace.t_command.tolist() == [0.0, 0.2]
    assert trace.codes.tolist() == [[32768] * 7] * 2
    # The wire carries abduction, flexion and flexor first.
    assert trace.counts[1].tolist() == [40, 50, 60, 70, 10, 20, 30]
    assert trace.spans_counts.tolist() == window_counts("right").tolist()
    assert trace.currents[0].tolist() == pytest.approx([0.65] * 6 + [-0.65])


def test_rows_that_were_not_read_are_left_out(tmp_path):
    fields = log()
    fields["pos"][1] = np.nan
    assert load_trace(write(tmp_path, fields)).t_read.tolist() == [0.0, 0.2]


@pytest.mark.parametrize("side", ["right", "left"])
def test_recording_comes_back_through_a_file(tmp_path, side):
    header = Header("excitation", "emulated", side, "0.2.0", map="paper", window="homed", unit="reference", seed=0)
    times = np.array([0.0, 0.02, 0.04])
    codes = np.outer(np.arange(3), np.full(7, 1000.0))

    def series(unit, rows, at=times):
        return Series.of(LABELS, (unit,) * 7, at, rows)

    recording = Recording(
        header,
        {
            "codes": series("u16", codes),
            "command_codes": series("u16", codes),
            "currents": series("A", np.full((1, 7), 0.5), times[1:2]),
        },
    )
    write_recording(recording, tmp_path / "a.mcap")
    trace = load_trace(tmp_path / "a.mcap")
    assert trace.codes.tolist() == codes.tolist()
    assert np.allclose(trace.counts, codes * window_counts(side) / 65535, atol=0.5)
    assert np.isnan(trace.currents[0]).all()
    assert trace.currents[2].tolist() == pytest.approx((0.5 * closing_current_sign(side)).tolist())
    assert np.isnan(trace.temperatures).all()


def test_a_channel_rests_some_time_after_it_was_told_to_open(tmp_path):
    times = np.arange(0.0, 2.0, 0.1)
    cmd = np.zeros((20, 7))
    cmd[5:10, 3] = 0.5  # the index, in wire order
    fields = {name: np.zeros((20, 7)) for name in ("pos", "cur_ma", "temp_c")}
    spans = log()["span_counts"]
    trace = load_trace(
        write(tmp_path, fields | {"t_cmd": times, "t_pos": times + 0.05, "cmd": cmd, "span_counts": spans})
    )
    rest = trace.at_rest()
    assert rest[:, 1:].all()
    assert rest[:, 0].tolist() == [True] * 5 + [False] * 9 + [True] * 6


@given(st.floats(0.1, 40.0), st.sampled_from(["steps", "ramps", "all"]))
@settings(deadline=None, max_examples=30)
def test_a_shortened_trace_has_the_first_motions_of_each_set_of_channels(seconds, name):
    codes = np.rint(excitation(name, scale=0.8).fractions * MAX_CODE).astype(np.int64)
    read = PERIOD_S * np.arange(len(codes))
    numbered = np.tile(np.arange(len(codes), dtype=float)[:, np.newaxis], 7)
    # Read just before each command, as a policy does.
    trace = Trace("a", read + 1e-3, codes, read, numbered, numbered, numbered, window_counts("right"))
    short = trace.shortened(seconds)
    kept = short.counts[:, 0].astype(int)
    periods = (read[kept] - short.t_read) / GRID_S
    assert np.allclose(periods, np.round(periods), atol=1e-6)
    assert np.diff(short.t_command).min() >= PERIOD_S - 1e-9
    told, told_whole = (t.codes[np.searchsorted(t.t_command, t.t_read[1:]) - 1] for t in (short, trace))
    assert np.array_equal(told, told_whole[kept[1:] - 1])
    moved = PERIOD_S * (short.codes > 0).sum(axis=0)
    assert np.all(moved[: len(FINGERS)] == moved[0])
    assert np.all(moved > 0.0)
    assert np.all(moved <= PERIOD_S * (codes > 0).sum(axis=0))
    if name == "all" and seconds < 8.0:
        assert short.t_read[-1] < 0.5 * read[-1]
