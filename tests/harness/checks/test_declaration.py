"""What a `checks.toml` says, and what is refused."""

import pytest

from hil.checks import JUDGED
from hil.checks.shared.declaration import parse_metric
from hil.checks.shared.subjects import CHANNELS

TABLE = {
    "name": "warmth", "evidence": "own_sensor", "unit": "K", "side": "above",
}  # fmt: skip


def parsed(**changes):
    return list(parse_metric("holding", TABLE | {"on": ["fingers"]} | changes))


def test_a_group_states_what_differs_and_inherits_the_rest():
    fingers, thumb = parsed(on={"fingers": {}, "thumb_flexor": {"side": "both", "unit": "mK"}})
    assert (fingers.subjects, fingers.unit) == (("index", "middle", "ring", "pinky"), "K")
    assert (thumb.subjects, thumb.unit) == (("thumb_flexor",), "mK")
    assert [bound.side for metric in (fingers, thumb) for bound in metric.bounds] == ["above", "both"]


def test_several_bounds_share_what_they_do_not_state():
    (metric,) = parsed(bounds=[{"firmware": ["pre"], "side": "both"}, {"firmware": ["0.2.0"]}])
    assert [(bound.firmware, bound.side) for bound in metric.bounds] == [(("pre",), "both"), (("0.2.0",), "above")]


def test_the_papers_numbers_are_those_of_the_subjects():
    fingers, thumb = parsed(on=["fingers", "thumb_flexor"], paper={"fingers": 2.0, "thumb_flexor": 3.0})
    assert fingers.paper == dict.fromkeys(("index", "middle", "ring", "pinky"), 2.0)
    assert thumb.paper == {"thumb_flexor": 3.0}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"on": ["toes"]}, "not toes"),
        ({"unit": None}, "missing key `unit`"),
        ({"colour": 1}, "unknown key"),
        ({"evidence": None}, "its bounds need `evidence`"),
        ({"evidence": "smell"}, "evidence is one of travel, .*, not 'smell'"),
    ],
)
def test_a_mistake_in_the_table_is_named(changes, message):
    table = {key: value for key, value in (TABLE | {"on": ["fingers"]} | changes).items() if value is not None}
    with pytest.raises(ValueError, match=f"check on warmth.*{message}"):
        list(parse_metric("holding", table))


@pytest.mark.parametrize("key", ["meaning", "remedy", "too_low"])
def test_a_check_names_no_cause(key):
    with pytest.raises(ValueError, match="unknown key"):
        parsed(**{key: "A loose cable."})


def test_the_table_beside_the_paper_has_the_papers_numbers():
    """The paper's table "Sim-to-real validation of the transmission model"."""
    staircase = JUDGED["staircase"]
    assert [metric.name for metric in staircase.columns] == [
        "excursion_model",
        "excursion_hand",
        "tracking_rms",
        "rise_model_ms",
        "rise_hand_ms",
        "overshoot_hand_percent",
        "settled_percent",
        "matched_steps",
    ]
    paper = {
        name: [staircase.metric(name, channel).paper[channel] for channel in CHANNELS]
        for name in ("excursion_hand", "tracking_rms", "rise_model_ms", "rise_hand_ms")
    }
    assert paper == {
        "excursion_hand": [44.45, 44.45, 44.45, 44.45, 1871.0, 16.57, 20.64],
        "tracking_rms": [0.45, 0.39, 0.39, 0.29, 26.79, 0.11, 0.63],
        "rise_model_ms": [90.0, 90.0, 90.0, 90.0, 70.0, 40.0, 60.0],
        "rise_hand_ms": [120.0, 120.0, 120.0, 120.0, 80.0, 80.0, 100.0],
    }
