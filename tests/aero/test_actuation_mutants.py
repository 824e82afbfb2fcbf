"""Seeded mistakes in the map, each of which at least one check must notice.

The checks compare with figures published elsewhere and with the mechanism, never with the map's own numbers.
"""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from aero import OBSERVATION_ORDER, ActuationMap, Channel, CommandWindow, Joint
from aero.protocol import WIRE_ORDER

WORKSPACE = np.array(
    [
        [0.0617776, 0.107723],
        [0.0621875, 0.1084],
        [0.0616733, 0.10775],
        [0.0637823, 0.109504],
        [0.0, 1.745],
        [0.026941, 0.0382787],
        [0.0839985, 0.110133],
    ]
)
SIGNS = [-1, -1, -1, -1, 1, -1, -1]


def rng():
    return np.random.default_rng(4)


def random_lengths():
    return rng().uniform(*WORKSPACE.T, (20, 7))


def check_published_map(codec):
    """The deployed map as one line a channel, degrees (aero-hand-open 7084ad3, its coefficients multiplied out)."""
    lengths = random_lengths()
    abduction, cmc, flexor = np.rad2deg(lengths[:, 4]), lengths[:, 5], lengths[:, 6]
    low, high = WORKSPACE[:4].T
    expected = np.column_stack(
        [
            288.1603 * (high - lengths[:, :4]) / (high - low),
            abduction,
            15.94285 * lengths[:, 4] - 6210.695 * cmc + 14.987 * flexor + 236.810,
            16.5204 * lengths[:, 4] - 349.446 * cmc - 7937.817 * flexor + 885.271,
        ]
    )
    angles = np.rad2deg(codec.angles_from_travel(codec.travel_from_lengths(lengths)))
    np.testing.assert_allclose(angles, expected, atol=0.04)


def check_published_codes(codec):
    """Shaft angles at which an unshifted hand shows a code; firmware baselines, 4096 counts a turn."""
    span_deg = np.array([288.1603, 288.1603, 288.1603, 288.1603, 100.0, 104.1250, 262.4289])
    low_deg = np.array([0.0, 0, 0, 0, 0, 0, -15.2789])
    shift_deg = np.array([0, 0, 0, 0, 9.9316, -9.9316, 0])
    low_deg += (codec.window.name in ("homed", "mixed")) * shift_deg
    span_deg -= (codec.window.name == "mixed") * shift_deg
    fraction = rng().uniform(0.0, 1.0, (20, 7))
    codes = codec.codes_from_angles(np.deg2rad(low_deg + fraction * span_deg * 0.9998))
    np.testing.assert_allclose(codes, fraction * 0.9998 * 65535, atol=10)


def check_codes_read_back(codec):
    codes = rng().integers(0, 65536, (20, 7))
    np.testing.assert_array_equal(codec.codes_from_angles(codec.angles_from_codes(codes)), codes)


def check_lengths_read_back(codec):
    lengths = random_lengths()
    error = np.abs(codec.lengths_from_travel(codec.travel_from_lengths(lengths)) - lengths).max(axis=0)
    assert (error < [1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 0.0797e-3, 0.572e-3]).all()


def check_published_inverse(codec):
    """Thumb lengths from shaft angles (aero-hand-open 7084ad3)."""
    angles = np.deg2rad(rng().uniform([0] * 7, [288, 288, 288, 288, 100, 104, 247], (20, 7)))
    lengths = codec.lengths_from_travel(codec.travel_from_angles(angles))
    abduction = angles[:, 4]
    np.testing.assert_allclose(lengths[:, 5], (37.517992 + 2.5 * abduction - 9 * angles[:, 5]) / 977.220399, atol=1e-7)
    np.testing.assert_allclose(
        lengths[:, 6], (136.590025 + 2.5 * abduction - 9 * angles[:, 6]) / 1241.571958, atol=1e-7
    )


def check_published_postures(codec):
    """The mechanism's rows, mm a radian (paper eqs. fingermap, thumbcmc, thumbflexor)."""
    joints = rng().uniform(0.0, 0.9, (20, 16))
    expected = np.zeros((20, 7))
    for finger in range(4):
        expected[:, finger] = joints[:, 3 * finger : 3 * finger + 3] @ [12.4912, 7.3211, 9.0]
    abduction, cmc, mcp, ip = (joints[:, j] for j in (12, 13, 14, 15))
    expected[:, 4] = abduction * 1e3
    expected[:, 5] = 2.5 * abduction + 12.4931 * cmc
    expected[:, 6] = 2.5 * abduction - 2.5 * cmc + 9.4372 * mcp + 12.5 * ip
    np.testing.assert_allclose(codec.travel_from_joints(joints) * 1e3, expected, atol=1e-6)


def check_postures_read_back(codec):
    compact = rng().uniform(0.0, 0.9, (20, 7))
    travel = codec.travel_from_joints(codec.joints_from_compact(compact))
    np.testing.assert_allclose(codec.compact_from_travel(travel), compact, atol=1e-9)


def check_signs(codec):
    """Nudging a command moves its own shaft as the mechanism must: a shorter cable closes, more abduction closes."""
    middle = WORKSPACE.mean(axis=1)
    nudged = middle + np.diag((WORKSPACE[:, 1] - WORKSPACE[:, 0]) / 4)
    difference = codec.codes_from_lengths(nudged).astype(int) - codec.codes_from_lengths(middle)
    assert np.sign(np.diag(difference)).tolist() == SIGNS
    assert (np.abs(np.diag(difference)) > 0.15 * 65535).all()
    assert not difference[:4][:, 4:].any()


def check_official_pose(codec):
    codes = codec.codes_from_lengths([0.083, 0.082, 0.082, 0.086, 0.75, 0.035, 0.1])
    published_deg = np.array([155.06, 164.62, 161.04, 148.13, 42.97, 32.89, 91.65])
    shown = np.rad2deg(codec.angles_from_codes(codes))
    np.testing.assert_allclose(shown, published_deg, atol=0.04)


CHECKS = [check for name, check in sorted(globals().items()) if name.startswith("check_")]
GOOD = [
    ActuationMap(),
    ActuationMap.for_firmware("0.2.0", "homed"),
    ActuationMap.for_firmware("0.2.0", "mixed", hand="left"),
]


def with_number(field, index, change):
    """A map whose coefficient at `index` of `field` is changed."""
    numbers = np.array(getattr(ActuationMap().coefficients, field))
    numbers[index] = change(numbers[index])
    as_tuples = tuple(map(tuple, numbers.tolist())) if numbers.ndim == 2 else tuple(numbers.tolist())
    return ActuationMap(replace(ActuationMap().coefficients, **{field: as_tuples}))


class MutantMap(ActuationMap):
    """A map that does something to what one of its stages takes or gives."""

    def mutate(self, stage, before=lambda x: x, after=lambda x: x):
        original = getattr(super(), stage)
        object.__setattr__(self, stage, lambda x: after(original(before(np.asarray(x)))))
        return self


def lying_about_its_window(window):
    """A map that uses another firmware's window than the one it names."""
    return ActuationMap(window=replace(window, name="unshifted"))


def flipped(channel):
    def flip(codes):
        codes = np.array(codes)
        codes[..., channel] = 65535 - codes[..., channel].astype(int)
        return codes

    return flip


def wrong_numbers():
    for field, shape in [("finger_winding", (3,)), ("thumb_winding", (2, 4)), ("thumb_regression", (3, 4))]:
        for index in np.ndindex(shape):
            if np.array(getattr(ActuationMap().coefficients, field))[index] != 0.0:
                yield f"sign of {field}{index}", with_number(field, index, lambda x: -x)
    for field in ("thumb_gain", "thumb_offset"):
        for index in range(2):
            yield f"sign of {field}[{index}]", with_number(field, index, lambda x: -x)
    for channel in range(4):
        interval = np.roll(ActuationMap().coefficients.finger_lengths, 1, axis=0)[channel]
        yield f"interval of finger {channel}", with_number("finger_lengths", channel, lambda _, i=interval: i)
    yield "spool radius 8 mm", ActuationMap(replace(ActuationMap().coefficients, spool_radius=8e-3))
    for field in ("thumb_winding", "thumb_regression", "thumb_gain", "thumb_offset"):
        swapped = getattr(ActuationMap().coefficients, field)[::-1]
        yield f"rows of {field} reversed", ActuationMap(replace(ActuationMap().coefficients, **{field: swapped}))


def wrong_windows():
    for version, state in [("0.2.0", "homed"), ("0.2.0", "mixed")]:
        for hand in ("right", "left"):
            window = CommandWindow.for_firmware(version, state, hand)
            yield f"window {state}, {hand}", lying_about_its_window(window)


def wrong_orders():
    for a, b in itertools.combinations(Channel, 2):
        order = list(range(7))
        order[a], order[b] = b, a
        for stage in ("codes_from_angles", "angles_from_travel", "travel_from_lengths", "lengths_from_travel"):
            mutant = MutantMap().mutate(stage, after=lambda x, o=order: x[..., o])
            yield f"{a.label} and {b.label} swapped after {stage}", mutant
    for name, order in [("wire", WIRE_ORDER), ("observation", OBSERVATION_ORDER)]:
        for stage in ("codes_from_angles", "travel_from_lengths", "lengths_from_travel", "compact_from_travel"):
            yield f"{name} order after {stage}", MutantMap().mutate(stage, after=lambda x, o=order: x[..., list(o)])
    for a, b in [
        (Joint.INDEX_MCP, Joint.INDEX_PIP),
        (Joint.RING_PIP, Joint.RING_DIP),
        (Joint.INDEX_MCP, Joint.PINKY_MCP),
        (Joint.THUMB_ABDUCTION, Joint.THUMB_CMC),
        (Joint.THUMB_MCP, Joint.THUMB_IP),
    ]:
        order = list(range(16))
        order[a], order[b] = b, a
        yield (
            f"{a.label} and {b.label} swapped",
            MutantMap().mutate("travel_from_joints", before=lambda x, o=order: x[..., o]),
        )


def wrong_signs_and_units():
    for channel in Channel:
        yield f"{channel.label} flipped", MutantMap().mutate("codes_from_angles", after=flipped(channel))
    yield "degrees for radians", MutantMap().mutate("angles_from_travel", after=np.rad2deg)
    yield "millimetres for metres", MutantMap().mutate("travel_from_lengths", before=lambda x: x * 1e3)
    yield "truncated", MutantMap().mutate("codes_from_angles", before=lambda x: x - 3e-5)


MUTANTS = dict([*wrong_numbers(), *wrong_windows(), *wrong_orders(), *wrong_signs_and_units()])


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("codec", GOOD, ids=lambda codec: codec.window.name)
def test_the_map_passes(codec, check):
    check(codec)


@pytest.mark.parametrize("name", MUTANTS)
def test_the_mutant_is_killed(name):
    def survives(check):
        try:
            check(MUTANTS[name])
        except (AssertionError, ValueError):
            return False
        return True

    assert not all(survives(check) for check in CHECKS)
