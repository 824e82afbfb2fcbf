"""How long a real fault lasts before the guard begins to open the hand, on an idle host and on one that is late."""

import pytest
from stopping_times import LATE, STOPPINGS


@pytest.mark.parametrize("host", LATE)
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("stopping", STOPPINGS, ids=lambda stopping: stopping.name)
def test_the_hand_is_opened_in_time(stopping, seed, host):
    assert stopping.seconds(host, seed) < stopping.most_s
