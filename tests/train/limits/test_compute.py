"""The steps from the readings of healthy hands to a limit, with numbers known by hand."""

import math

import numpy as np
import pytest

from hil.checks.shared.declaration import Bound
from train.limits.compute import FALSE_ALARMS, FEWEST, Healthy, _outward, computed_limits, upper_bound

INDEX, RING = ("staircase", "friction", "index"), ("staircase", "friction", "ring")
BOTH = Bound("staircase", "friction", ("index", "ring"), side="both")
ONE = Bound("staircase", "friction", ("index",), side="both")
STEPS = 1.0 * np.arange(100)


def hands(values, version="0.2.0", *, ring=(), guarded=False):
    return Healthy((version,), {INDEX: np.asarray(values, float), RING: np.asarray(ring, float)}, guarded)


def pareto(chance, excesses):
    """Return the quantile of a generalised Pareto distribution from sample L-moments, written out."""
    x, n = np.sort(excesses), len(excesses)
    mean = x.sum() / n
    second = 2 * (np.arange(n) * x).sum() / n / (n - 1) - mean
    shape = 2 - mean / second
    scale = mean * (1 - shape)
    return scale / shape * (chance**-shape - 1), shape


def test_the_tail_is_carried_on_as_a_generalised_pareto_distribution():
    """85 readings of 0 and 15 beyond; the threshold is 0, and 15 % lie beyond it."""
    excesses = np.arange(1, 16) ** 2.0
    expected, shape = pareto(0.01, excesses)
    assert -0.25 < shape < 0.1
    assert upper_bound(np.append(np.zeros(86), excesses), 0.0015) == pytest.approx(expected)


def test_the_shape_of_a_tail_is_bounded():
    """Equal steps have shape -0.94, which counts as -0.25; a far outlier has more than 0.1, which counts as that."""
    # Of 85 to 99, beyond 84.15: the mean is 7.85, so that the end lies 1.25 x 7.85 x 4 beyond.
    assert upper_bound(STEPS, 0.0015) == pytest.approx(84.15 + 1.25 * 7.85 * 4 * (1 - 0.01**0.25))
    excesses = np.append(np.ones(14), 100.0) + 0.01 * np.arange(15)
    expected = excesses.mean() * 0.9 / 0.1 * (0.01**-0.1 - 1)
    assert upper_bound(np.append(np.zeros(86), excesses), 0.0015) == pytest.approx(expected)


def test_a_tail_of_fewer_than_eight_or_of_one_value_is_its_end():
    readings = np.append(np.zeros(60), np.arange(1.0, 8.0))
    assert upper_bound(readings, 1e-4) == 7.0
    assert upper_bound(np.append(readings, 8.0), 1e-4) > 8.0
    assert upper_bound(np.append(np.zeros(100), np.full(10, 3.0)), 1e-4) == 3.0


def test_a_tail_whose_values_differ_by_rounding_alone_is_its_end():
    """A median that was taken off leaves such steps."""
    steps = np.append(np.full(9, 3.0), np.nextafter(3.0, 4.0))
    assert upper_bound(np.append(np.zeros(100), steps), 1e-4) == pytest.approx(3.0, abs=1e-9)


def test_a_limit_goes_beyond_many_readings_by_half_their_range_at_most():
    """Readings of one finger in equal steps from 0 to 99, median 49.5, one bound with two sides."""
    (limit,) = computed_limits([ONE], [hands(STEPS)])
    beyond = upper_bound(STEPS - 49.5, FALSE_ALARMS / 2)
    assert beyond < 99
    assert limit.at_most == pytest.approx(49.5 + beyond, abs=1.0)
    assert limit.at_least == pytest.approx(49.5 - beyond, abs=0.1)
    assert limit.healthy == (0.0, 99.0)
    assert limit.firmware == ("0.2.0",)
    assert limit.source == "100 readings of healthy hands with such firmware"
    far = np.append(np.zeros(86), 1.1 ** np.arange(15.0))
    # Two hundred bounds leave each a chance so small that the tail goes on for longer than that.
    limit = computed_limits([ONE] * 200, [hands(far)])[0]
    assert limit.at_most == pytest.approx(1.5 * far.max(), abs=0.01)
    assert limit.at_least == _outward(-0.005 * far.max(), -1)


def test_all_sides_and_subjects_share_the_false_alarms():
    """Two bounds of two sides and one of one side are five; two fingers halve the share of each."""
    one_sided = Bound("audit", "pull", ("index",), side="above")
    other = Bound("audit", "followed", ("index",), side="both")
    pool = hands(STEPS, ring=STEPS)
    readings = dict.fromkeys([("audit", "pull", "index"), ("audit", "followed", "index")], STEPS)
    group = Healthy(pool.firmware, {**pool.population, **readings})
    found = computed_limits([BOTH, one_sided, other], [group])
    doubled = upper_bound(np.append(STEPS, STEPS) - 49.5, FALSE_ALARMS / 5 / 2)
    single = upper_bound(STEPS - 49.5, FALSE_ALARMS / 5)
    assert found[0].at_least == _outward(49.5 - doubled, -1)
    assert found[2].at_least == _outward(49.5 - single, -1)
    assert math.isinf(found[1].at_least)
    assert found[1].at_most == found[2].at_most == _outward(49.5 + single, 1)


def test_versions_have_limits_of_their_own_about_their_median_and_share_the_spread():
    groups = [hands(STEPS), hands(1000.0 + STEPS[:80], "0.1.5")]
    first, second = computed_limits([ONE], groups)
    beyond = upper_bound(np.append(STEPS - 49.5, STEPS[:80] - 39.5), FALSE_ALARMS / 2)
    assert (first.at_most, first.firmware) == (_outward(49.5 + beyond, 1), ("0.2.0",))
    assert (second.at_most, second.firmware) == (_outward(1039.5 + beyond, 1), ("0.1.5",))
    assert second.readings == 80
    limited = Bound("staircase", "friction", ("index",), ("0.1.5",), side="both")
    (only,) = computed_limits([limited], groups)
    assert only.firmware == ("0.1.5",)


def test_a_firmware_with_few_readings_shares_the_limit_of_all():
    """59 readings of one version are too few, with those of the other they are 159."""
    own, shared = computed_limits([ONE], [hands(STEPS), hands(1000.0 + STEPS[: FEWEST - 1], "0.1.5")])
    assert (own.firmware, own.readings) == (("0.2.0",), 100)
    assert (shared.firmware, shared.readings, shared.healthy) == (("0.1.5",), 159, (0.0, 1058.0))


def test_guarded_hands_with_few_readings_share_the_limit_of_their_firmware():
    few = -1000.0 + STEPS[:40]
    groups = [
        hands(STEPS), hands(few, guarded=True), hands(STEPS, "0.1.5"), hands(few, "0.1.5", guarded=True),
    ]  # fmt: skip
    rows = [(limit.firmware, limit.guarded, limit.readings) for limit in computed_limits([ONE], groups)]
    assert rows == [(("0.2.0",), None, 140), (("0.1.5",), None, 140)]


def test_a_check_with_few_readings_in_all_is_not_judged():
    assert computed_limits([ONE], [hands(STEPS[: FEWEST - 1])]) == ()


def test_a_bound_that_is_given_is_not_computed():
    given = Bound("session", "restarts", ("hand",), ("0.2.0",), at_most=0.0, at_least=-1.0, source="no restart")
    assert computed_limits([given], []) == ()


def test_a_check_without_readings_is_an_error():
    with pytest.raises(ValueError, match=r"no healthy hand of firmware 0\.2\.0 measured staircase friction"):
        computed_limits([ONE], [hands([]), hands([1.0], "0.1.5")])


def test_readings_that_are_not_there_are_left_out():
    (limit,) = computed_limits([ONE], [hands([math.nan, *STEPS])])
    assert limit.healthy == (0.0, 99.0)


def test_recorded_hands_widen_what_is_healthy():
    bound = Bound("staircase", "friction", ("index",), side="both", recorded=(-500.0, 1.0))
    (limit,) = computed_limits([bound], [hands(STEPS)])
    assert limit.healthy == (-500.0, 99.0)
    assert limit.at_least == _outward(-500.0 * 1.005, -1)


def test_guarded_hands_share_a_limit_that_holds_them():
    free = hands(STEPS)
    (limit,) = computed_limits([ONE], [free, hands(STEPS - 1.0, guarded=True)])
    assert limit.guarded is None
    assert limit.healthy == (-1.0, 99.0)
    assert computed_limits([ONE], [free, hands([], guarded=True)])[0].guarded is None
    apart = computed_limits([ONE], [free, hands(STEPS - 200.0, guarded=True)])
    assert [(limit.guarded, limit.healthy) for limit in apart] == [(False, (0.0, 99.0)), (True, (-200.0, -101.0))]
    above = computed_limits([ONE], [free, hands(STEPS + 200.0, guarded=True)])
    assert [limit.guarded for limit in above] == [False, True]


@pytest.mark.parametrize(
    ("value", "up", "down"),
    [(1234.0, 1240.0, 1230.0), (0.012341, 0.0124, 0.0123), (-1234.0, -1230.0, -1240.0), (7.0, 7.0, 7.0), (0.0, 0, 0)],
)
def test_bounds_have_three_figures_and_are_rounded_outwards(value, up, down):
    assert _outward(value, 1) == up
    assert _outward(value, -1) == down
