import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aero import ActuationMap, CommandWindow
from aero.actuation.representations import REPRESENTATIONS, convert

MAPS = [
    ActuationMap.for_firmware("0.2.0", state, hand=hand)
    for state in ("homed", "mixed", "unshifted")
    for hand in ("right", "left")
]
BOTH_WAYS = [name for name, representation in REPRESENTATIONS.items() if representation.to_travel]
EXACT = [name for name in BOTH_WAYS if name not in ("codes", "counts", "lengths")]
# Reachable in every window, degrees.
POSTURES = st.tuples(*[st.floats(0.0, 90.0)] * 4, st.floats(10.0, 90.0), st.floats(0.0, 40.0), st.floats(20.0, 80.0))


@pytest.mark.parametrize("codec", MAPS, ids=lambda codec: f"{codec.window.name}-{codec.window.hand}")
@given(posture=POSTURES, path=st.lists(st.sampled_from(EXACT), max_size=4))
def test_a_compact_posture_survives_any_path_without_quantisation(codec, posture, path):
    values, at = posture, "compact"
    for step in [*path, "compact"]:
        values, at = convert(codec, values, at, step).values, step
    np.testing.assert_allclose(values, posture, atol=1e-9)


@pytest.mark.parametrize("codec", MAPS, ids=lambda codec: f"{codec.window.name}-{codec.window.hand}")
@given(posture=POSTURES)
def test_codes_and_counts_cost_their_quantum(codec, posture):
    for quantised, quantum_deg in [("codes", 0.5 / 65535 * 300), ("counts", 360 / 4096 + 0.5 / 65535 * 300)]:
        shafts = convert(codec, posture, "compact", "angles").values
        back = convert(codec, convert(codec, posture, "compact", quantised).values, quantised, "angles").values
        # The flexor's window has 2980 counts where its angles would make 2986.
        tolerance = np.array([quantum_deg] * 6 + [1.01 * quantum_deg])
        assert (np.abs(back - shafts) <= tolerance).all()


def test_counts_are_the_firmwares_own():
    """Published examples of the firmware's arithmetic, right and left, unshifted."""
    codes = np.array([0, 3815, 16384, 32767, 32768, 49152, 65526, 65535])
    expected = {
        "right": {
            4: [2048, 1982, 1764, 1480, 1479, 1195, 911, 910],
            5: [3231, 3163, 2936, 2640, 2640, 2344, 2049, 2048],
            6: [1115, 1288, 1860, 2604, 2605, 3350, 4094, 4095],
            0: [3278, 3088, 2459, 1640, 1639, 820, 1, 0],
        },
        "left": {
            4: [2048, 2114, 2332, 2616, 2617, 2901, 3185, 3186],
            5: [865, 933, 1160, 1456, 1456, 1752, 2047, 2048],
            6: [2980, 2807, 2235, 1491, 1490, 745, 1, 0],
            3: [817, 1007, 1636, 2455, 2456, 3275, 4094, 4095],
        },
    }
    for hand, channels in expected.items():
        window = CommandWindow.for_firmware("0.1.0", hand=hand)
        for channel, counts in channels.items():
            spread = np.zeros((8, 7), int)
            spread[:, channel] = codes
            assert window.counts_from_codes(spread)[:, channel].tolist() == counts


@pytest.mark.parametrize(
    ("hand", "channel", "counts", "codes"),
    [
        ("right", 0, [0, 1, 2047, 2048, 3278, 4095], [65535, 65515, 24610, 24590, 0, 0]),
        ("right", 4, [2047, 1115], [57, 53729]),
        ("right", 5, [2049], [65479]),
        ("right", 6, [2048, 4094], [20518, 65513]),
        ("left", 0, [2048, 4094], [24610, 65515]),
    ],
)
def test_readings_are_the_firmwares_own(hand, channel, counts, codes):
    window = CommandWindow.for_firmware("0.1.0", hand=hand)
    spread = np.full((len(counts), 7), 2000)
    spread[:, channel] = counts
    assert window.codes_from_counts(spread)[:, channel].tolist() == codes


def test_the_sdk_gets_its_own_codes():
    assert convert(ActuationMap(), [0.0] * 16, "joints", "sdk-codes").values.tolist() == [0] * 6 + [3815]
    # aero-open-sdk 0.1.0.dev1 with every joint at its limit.
    limits = [90.0] * 12 + [100.0, 55.0, 90.0, 90.0]
    sent = convert(ActuationMap(), limits, "joints", "sdk-codes").values.tolist()
    assert sent == [65526] * 4 + [65535, 65534, 61719]


def test_saturation_is_reported_and_kept_to_the_channels_that_need_it():
    codec = ActuationMap.for_firmware("0.2.0")
    result = convert(codec, [31.1] * 4 + [0.0, 20.0, 10.0], "compact", "angles", saturate=True)
    assert result.saturated.tolist() == [False] * 4 + [True, False, False]
    assert result.values[4] == pytest.approx(113 / 4096 * 360)
    exact = convert(codec, [31.1] * 4 + [20.0, 20.0, 10.0], "compact", "angles").values
    np.testing.assert_allclose(result.values[:4], exact[:4], atol=1e-12)
    assert convert(codec, [30.0] * 7, "compact", "compact", saturate=True).values.tolist() == [30.0] * 7
