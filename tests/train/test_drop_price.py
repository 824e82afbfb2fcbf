from math import exp

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("jax", reason="needs the extra `train`")

from train.recipe import DropPrice
from train.run_state import Tendency

PRICE = DropPrice()
prices = st.floats(*PRICE.bounds)
hazards = st.floats(0.0, 1.0)
rates = st.floats(-2.0, 3.0)


@given(st.floats(0.0, 1e4), hazards, rates)
def test_the_price_never_leaves_its_bounds(price, hazard, rate):
    assert 60.0 <= PRICE.after(price, hazard_per_s=hazard, rate_rad_s=rate) <= 400.0


@given(prices, hazards, hazards, st.floats(0.16, 3.0))
def test_more_drops_never_make_a_drop_cheaper(price, one, other, rate):
    fewer, more = sorted((one, other))
    after = [PRICE.after(price, hazard_per_s=hazard, rate_rad_s=rate) for hazard in (fewer, more)]
    assert after[0] <= after[1]


@pytest.mark.parametrize(
    ("hazard", "rate", "factor"),
    [
        (0.005, 0.5, 1.0),
        (0.010, 0.5, exp(0.006)),
        (0.100, 0.5, exp(0.012)),
        (0.000, 0.5, exp(-0.006)),
        (0.100, 0.15, exp(-0.01)),
        (0.000, 0.0, exp(-0.01)),
    ],
)
def test_the_price_changes_as_the_recipe_says(hazard, rate, factor):
    """Half a percent a second is asked for; where hands hardly turn, drops are not what is wrong."""
    assert PRICE.after(100.0, hazard_per_s=hazard, rate_rad_s=rate) == pytest.approx(100.0 * factor)


@given(st.lists(st.tuples(rates, hazards), min_size=1, max_size=20))
def test_the_tendency_of_the_first_updates_is_their_mean(made):
    tendency = Tendency()
    for rate, hazard in made:
        tendency = tendency.after(rate, hazard)
    assert tendency.rate_rad_s == pytest.approx(sum(rate for rate, _ in made) / len(made), abs=1e-9)
    assert tendency.hazard_per_s == pytest.approx(sum(hazard for _, hazard in made) / len(made), abs=1e-9)


def test_the_tendency_looks_back_on_twenty_updates():
    tendency = Tendency(0.0, 0.0, updates=1000).after(1.0, 0.2)
    assert (tendency.rate_rad_s, tendency.hazard_per_s) == pytest.approx((1 / 20, 0.2 / 20))
