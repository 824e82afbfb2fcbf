"""Damaged files: each reader gives back what it can use or raises the one error that it declares, quick and small."""

import os
import time
import warnings
import zipfile

import numpy as np
import pytest
from damaged_files import CORPUS, READERS, answered, damaged
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer

from hil.recordings.mcap_file import FORMAT, METADATA

try:
    import resource
except ImportError:  # Windows
    resource = None

LONGEST_S = 2.0
MOST_MB = 500
BY_NAME = {reader.name: reader for reader in READERS}
EACH = int(os.environ.get("DAMAGED_FILES", "5000")) // len(READERS)
"""Damaged files of each kind in the slow test."""
each_reader = pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """The content of a good file of each kind."""
    folder = tmp_path_factory.mktemp("good")
    for reader in READERS:
        reader.write(folder / reader.name)
    return {reader.name: (folder / reader.name).read_bytes() for reader in READERS}


@pytest.fixture(autouse=True)
def _bounded():
    """What a test reads takes little memory; a deprecated literal in a damaged file is no business of ours."""
    before = peak_mb()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
    assert peak_mb() - before < MOST_MB


def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 if resource else 0.0


@each_reader
def test_a_good_file_is_read(reader, good, tmp_path):
    assert not answered(reader, good[reader.name], tmp_path)


@each_reader
@given(seed=st.integers(0, 2**32 - 1))
def test_a_damaged_file_is_answered(reader, seed, good, tmp_path):
    answered(reader, damaged(good[reader.name], seed), tmp_path)


@pytest.mark.slow
@each_reader
def test_thousands_of_damaged_files_are_answered(reader, good, tmp_path):
    refused, longest = 0, 0.0
    for seed in range(EACH):
        begin = time.process_time()
        refused += answered(reader, damaged(good[reader.name], seed), tmp_path)
        longest = max(longest, time.process_time() - begin)
    print(f"\n{reader.name}: {refused} of {EACH} refused, {longest:.3f} s at most, peak {peak_mb():.0f} MB")
    assert longest < LONGEST_S


@pytest.mark.parametrize("path", sorted(CORPUS.iterdir()), ids=lambda path: path.name)
def test_what_once_was_not_answered_is(path, tmp_path):
    reader = next(reader for reader in READERS if path.name.startswith(reader.name))
    assert answered(reader, path.read_bytes(), tmp_path)


@pytest.mark.parametrize("name", ["policy.npz", "log.npz"])
def test_a_zip_bomb_is_not_unpacked(name, tmp_path):
    bomb = tmp_path / "bomb"
    with (
        zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("x.npy", "w") as part,
    ):
        for _ in range(150):
            part.write(bytes(2**20))
    assert bomb.stat().st_size < 3 * 2**20
    assert answered(BY_NAME[name], bomb.read_bytes(), tmp_path)


@pytest.mark.parametrize("name", ["policy.npz", "log.npz"])
def test_an_array_that_claims_four_petabytes_is_given_no_memory(name, tmp_path):
    path = tmp_path / "claim"
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000000,), }"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mean.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    assert answered(BY_NAME[name], path.read_bytes(), tmp_path)


def test_a_recording_with_a_chunk_larger_than_any_of_ours_is_refused(tmp_path):
    path = tmp_path / "large"
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=2**30)
        writer.start()
        channel = writer.register_channel("/x", "json", 0)
        for _ in range(70):
            writer.add_message(channel, 0, bytes(2**20), 0)
        writer.finish()
    assert answered(BY_NAME["recording.mcap"], path.read_bytes(), tmp_path)


def test_deep_nesting_is_refused(tmp_path):
    deep = b"[" * 100_000
    for name in ("checks.json", "state.json", "unit.toml", "coefficients.toml"):
        assert answered(BY_NAME[name], b"a = " * name.endswith("toml") + deep, tmp_path)


def test_a_recording_whose_header_nests_deeply_is_refused(tmp_path):
    path = tmp_path / "deep"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.add_metadata(METADATA, {"format": FORMAT, "header": "[" * 100_000})
        writer.finish()
    assert answered(BY_NAME["recording.mcap"], path.read_bytes(), tmp_path)


def test_a_pickle_that_remembers_too_much_is_refused(tmp_path):
    assert answered(BY_NAME["checkpoint.pkl"], b"\x80\x02Nr\xff\xff\xff\x7f.", tmp_path)


def test_an_array_of_objects_is_not_unpickled(tmp_path):
    path = tmp_path / "objects.npz"
    np.savez(path, header=np.array([{"a": 1}], dtype=object))
    assert answered(BY_NAME["policy.npz"], path.read_bytes(), tmp_path)
