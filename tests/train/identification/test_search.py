from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aero.channels import Channel
from train.identification.cross_validation import PARTS, held_out
from train.identification.search import (
    EVALUATIONS,
    NOISE_COUNTS,
    find_slopes,
    pooled_rms,
    search,
    slope_groups,
    solved,
    without_rounding,
)
from train.identification.unit_parameters import Free

ALL = tuple(Channel)
TRUTH = np.array([0.7, -0.4, *np.linspace(-0.5, 0.5, 7)])
FREE = (
    Free("gain", (), ALL, 0.6),
    Free("bend", (), ALL, 0.2),
    *(Free("offset", (c,), (c,), 0.6) for c in Channel),
)


ran = []
"""Batches of predictions of the toys of this test."""


@pytest.fixture(autouse=True)
def _nothing_ran_yet():
    ran.clear()


@dataclass(frozen=True)
class Reads:
    """What a trace has that leaving parts out asks for."""

    t_read: np.ndarray


@dataclass(frozen=True)
class Toy:
    """Traces are noise-free curves of known numbers, on a grid with a known phase."""

    lengths: tuple[int, ...] = (30, 40, 20, 25)
    free: tuple[Free, ...] = FREE
    phases_s: tuple[float, ...] = (0.0, 0.005)
    interrupt_after: int | None = None
    interruption: type[BaseException] = KeyboardInterrupt

    @property
    def traces(self):
        return [Reads(np.arange(m, dtype=float)) for m in self.lengths]

    def residuals(self, x, phases_s):
        ran.append(len(x))
        if self.interrupt_after is not None and len(ran) > self.interrupt_after:
            raise self.interruption
        return [
            self.curve(k % len(self.lengths), xk, p) - self.curve(k % len(self.lengths), TRUTH, 0.005)
            for k, (xk, p) in enumerate(zip(x, phases_s, strict=True))
        ]

    def curve(self, k, x, phase):
        t = np.linspace(0.0, 1.0 + k, self.lengths[k])[:, None]
        return 40.0 * x[0] * np.sin(t + 200 * phase) + 30.0 * np.exp(x[1] * t) + 50.0 * x[None, 2:]


def test_search_finds_the_numbers_and_the_phase():
    found = search(Toy(), iterations=20)
    assert found.x == pytest.approx(TRUTH, abs=0.2)  # a phase that is a little off looks like another bend
    assert found.phases_s == pytest.approx((0.005,) * 4, abs=0.001)
    assert pooled_rms(found.residuals) < 2.0


@pytest.mark.parametrize(("lengths", "parts"), [((30, 40, 20, 25), 4), ((30,), PARTS)])
def test_what_is_left_out_is_predicted_from_the_others_without_a_replay(lengths, parts):
    toy = Toy(lengths)
    found = search(toy, iterations=20)
    ran.clear()
    held = held_out(toy, found)
    assert ran == []
    assert [sum(len(one[k]) for one in held) for k in range(len(lengths))] == list(lengths)
    assert len(held) == parts
    assert pooled_rms(found.residuals) < pooled_rms(r for one in held for r in one) < 2.0


def test_a_search_goes_on_from_what_a_coarser_model_found():
    toy = Toy()
    coarse = search(Toy((12, 16, 8, 10)), iterations=20)
    found = search(toy, begin=coarse, iterations=1)
    assert found.x == pytest.approx(TRUTH, abs=0.2)
    assert found.phases_s == pytest.approx((0.005,) * 4, abs=0.001)
    assert [len(r) for r in found.residuals] == list(toy.lengths)


def test_a_search_goes_on_while_an_iteration_gains_enough_and_says_how_much_the_last_one_did():
    far = search(Toy((12, 16, 8, 10)), iterations=0)
    once, more = (search(Toy(), begin=far, iterations=most, worth=0.1) for most in (1, 10))
    assert once.gain > 0.1 > more.gain
    assert pooled_rms(more.residuals) < pooled_rms(once.residuals)


@given(st.floats(0.0, 0.999), st.floats(1.0, 30.0))
def test_rounding_tells_nothing_of_a_number(unfelt, felt):
    """A replay reads whole counts: a number that changes them by less than one has no slope, a larger one its own."""

    @dataclass(frozen=True)
    class Whole(Toy):
        def curve(self, k, x, phase):
            t = np.linspace(0.0, 50.0, self.lengths[k])[:, None]
            return np.floor(t + 2.0 * felt * x[0] / 0.18 + unfelt * x[1] / 0.06 + 0.0 * x[None, 2:])

    toy = Whole(lengths=(400,))
    start = toy.residuals([np.zeros(9)], (0.005,))
    slope = without_rounding(find_slopes(toy, np.zeros(9), (0.005,), start), FREE)[0]
    assert not slope[..., 1:].any()
    assert slope[..., 0].mean() == pytest.approx(2.0 * felt / 0.18, rel=0.05)


@pytest.mark.parametrize("batches", [0, 1, 2])
def test_an_interruption_of_what_goes_on_keeps_what_a_coarser_model_found(batches):
    coarse = search(Toy((12, 16, 8, 10)), iterations=3)
    ran.clear()
    found = search(Toy(interrupt_after=batches), begin=coarse, iterations=1)
    assert isinstance(found.interrupted, KeyboardInterrupt)
    assert np.array_equal(found.x, coarse.x)


@given(st.lists(st.tuples(st.sampled_from("ab"), st.sets(st.sampled_from(ALL), min_size=1)), min_size=1, max_size=12))
def test_every_number_is_in_one_group_in_which_no_channel_feels_two(rows):
    free = tuple(Free(name, (), tuple(channels), 1.0) for name, channels in rows)
    groups = slope_groups(free)
    assert sorted(row for group in groups for row in group) == list(range(len(free)))
    for group in groups:
        felt = [channel for row in group for channel in free[row].channels]
        assert len(felt) == len(set(felt))


def test_what_does_not_depend_on_each_other_is_predicted_at_once():
    """So that one long recording keeps every process busy."""
    toy = Toy(lengths=(30,))
    search(toy, iterations=1)
    phases, groups = len(toy.phases_s), len(slope_groups(FREE))
    assert ran[:2] == [phases, groups]
    assert ran[-2:] == [phases, 2]
    assert 1 <= len(ran) - 4 <= EVALUATIONS - 1
    assert set(ran[2:-2]) == {1}


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
@settings(max_examples=30)
def test_what_is_linear_is_solved_as_a_ridge_problem(seed, numbers):
    draw = np.random.default_rng(seed)
    slope, there = draw.normal(size=(20, 7, numbers)), draw.normal(size=(20, 7))
    x, spread = 0.1 * draw.normal(size=numbers), draw.uniform(0.5, 2.0, numbers)
    solution = solved(lambda at: [there + slope @ at], [slope], x, spread, NOISE_COUNTS)
    rows = np.vstack([slope.reshape(-1, numbers) / NOISE_COUNTS, np.diag(1.0 / spread)])
    wanted = np.concatenate([there.ravel() / NOISE_COUNTS, np.zeros(numbers)])
    assert solution == pytest.approx(-np.linalg.lstsq(rows, wanted, rcond=None)[0], abs=1e-9)


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("batches", [2, 4, 6, 9])
def test_an_interrupted_search_returns_the_best_so_far(batches, interruption):
    found = search(Toy(interrupt_after=batches, interruption=interruption), iterations=20)
    assert isinstance(found.interrupted, interruption)
    ran.clear()
    toy = Toy()
    start, whole = toy.residuals([np.zeros(9)] * 4, found.phases_s), search(toy, iterations=20)
    assert pooled_rms(whole.residuals) < pooled_rms(found.residuals) <= pooled_rms(start)
    assert pooled_rms(found.residuals) == pooled_rms(toy.residuals([found.x] * 4, found.phases_s))
