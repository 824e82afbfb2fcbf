import array_api_strict as strict
import numpy as np
import pytest

from aero import ActuationMap

MAP = ActuationMap.for_firmware("0.2.0")
RNG = np.random.default_rng(7)
NOMINAL = np.array([0.083, 0.082, 0.082, 0.086, 0.75, 0.035, 0.1])
LENGTHS = NOMINAL * RNG.uniform(0.95, 1.05, (50, 7))
JOINTS = RNG.uniform(0.2, 0.9, (50, 16))


def test_inside_a_jax_trace():
    jax = pytest.importorskip("jax")

    @jax.jit
    def there_and_back(lengths, joints):
        codes, saturated = MAP.saturating_codes(MAP.angles_from_travel(MAP.travel_from_lengths(lengths)))
        posture = MAP.saturating_codes(MAP.angles_from_travel(MAP.travel_from_joints(joints)))
        return codes, saturated, MAP.lengths_from_codes(codes), posture.codes, MAP.compact_from_codes(posture.codes)

    codes, saturated, back, posture, compact = there_and_back(LENGTHS, JOINTS)
    expected, posture_expected = MAP.codes_from_lengths(LENGTHS), MAP.codes_from_joints(JOINTS)
    assert codes.dtype == np.uint16
    assert not saturated.any()
    # Single precision is worth a hundredth of a code; it shows only where that decides a rounding.
    assert np.abs(np.asarray(codes, int) - expected).max() <= 1
    assert (np.asarray(codes) == expected).mean() > 0.9
    assert np.abs(np.asarray(posture, int) - posture_expected).max() <= 1
    np.testing.assert_allclose(back, MAP.lengths_from_codes(np.asarray(codes)), atol=2e-7)
    np.testing.assert_allclose(compact, MAP.compact_from_codes(np.asarray(posture)), atol=2e-6)


def test_vectorised_by_jax():
    jax = pytest.importorskip("jax")
    one_by_one = jax.vmap(MAP.travel_from_lengths)(LENGTHS)
    np.testing.assert_allclose(one_by_one, MAP.travel_from_lengths(LENGTHS), rtol=1e-4, atol=1e-7)
    jacobian = jax.jacobian(MAP.travel_from_joints)(jax.numpy.asarray(JOINTS[0]))
    np.testing.assert_allclose(jacobian, MAP.winding_matrix, atol=1e-9)


def test_every_stage_keeps_to_the_array_api():
    lengths, joints = strict.asarray(LENGTHS), strict.asarray(JOINTS)
    codes = MAP.codes_from_lengths(lengths)
    back = MAP.lengths_from_codes(codes)
    compact = MAP.compact_from_codes(MAP.codes_from_joints(joints))
    assert {array.__array_namespace__() for array in (codes, back, compact)} == {strict}
    np.testing.assert_array_equal(np.asarray(codes), MAP.codes_from_lengths(LENGTHS))
    np.testing.assert_array_equal(np.asarray(MAP.codes_from_compact(compact)), MAP.codes_from_joints(JOINTS))


def test_integers_are_taken_for_the_numbers_that_they_are():
    degrees = np.arange(16)
    expected = MAP.travel_from_joints(degrees.astype(float))
    np.testing.assert_array_equal(MAP.travel_from_joints(degrees), expected)
    np.testing.assert_array_equal(np.asarray(MAP.travel_from_joints(strict.asarray(degrees))), expected)


def test_single_precision_stays_single():
    codes = MAP.codes_from_lengths(LENGTHS.astype(np.float32))
    assert np.abs(codes.astype(int) - MAP.codes_from_lengths(LENGTHS)).max() <= 1
    assert MAP.travel_from_lengths(LENGTHS.astype(np.float32)).dtype == np.float32
