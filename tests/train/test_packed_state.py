import numpy as np
import pytest

pytest.importorskip("jax", reason="needs the extra `train`")

from train.drop_price import Tendency
from train.packed_state import pack, unpack
from train.run_state import STATE, Standing, load_arrays, read_standing, save_state


def test_a_packed_state_is_smaller_and_comes_back_to_the_bit(tmp_path):
    rng = np.random.default_rng(0)
    arrays = {
        "weights": rng.normal(size=(64, 32)).astype(np.float32),
        "still": np.zeros((100, 40), np.float32),
        "nothing": np.zeros((0, 3)),
        "key": np.array([1, 2], np.uint32),
        "count": np.int32(-5),
    }
    standing = Standing("steady", 3, steps=5, tendency=Tendency(0.1, 0.2, 3), drop_price=71.5)
    for name in ("run", "again"):
        (tmp_path / name).mkdir()
    save_state(tmp_path / "run", standing, arrays)
    pack(tmp_path / "run", tmp_path / "packed")
    unpack(tmp_path / "again", tmp_path / "packed")
    assert read_standing(tmp_path / "again") == standing
    for name, array in load_arrays(tmp_path / "again", arrays).items():
        np.testing.assert_array_equal(array, arrays[name])
        assert np.asarray(array).dtype == (np.float32 if name == "nothing" else arrays[name].dtype)
    assert (tmp_path / "packed").stat().st_size < 0.6 * (tmp_path / "run" / STATE).stat().st_size
    with pytest.raises(FileExistsError, match="holds a run"):
        unpack(tmp_path / "again", tmp_path / "packed")
