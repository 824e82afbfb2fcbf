"""What ships says of hands that it was learned from, pinned: the place, its share, and that the cause is shown."""

from pathlib import Path

import pytest

from hil.faults import CATALOGUE, parse_fault
from hil.lab.campaign.kept_readings import DICTIONARY, DRAWN, parse_kept
from hil.lab.campaign.population import kind_of
from hil.verdict.diagnose import diagnose
from hil.verdict.ending import Ending
from hil.verdict.limits import load_limits

HANDS = Path(__file__).parents[4] / "hil" / "data" / "hands"
KEPT = {
    str(hand.trial.faults[0]): hand
    for part in (DICTIONARY, DRAWN)
    for hand in parse_kept((HANDS / f"{part}.json").read_text(encoding="utf-8"))
}


@pytest.mark.parametrize(
    ("fault", "where", "share"),
    [
        ("late_goals=30.0", "several channels", 0.89),
        ("spring_strong:index=2.0", "index (one channel)", 0.95),
        ("winding_reversed:ring=1.0", "ring (one channel)", 0.97),
        ("nvs_lost=1.0", "board", 0.91),
        ("thumb_derailed:thumb_flexor=5.75", "thumb_flexor (one channel)", 0.88),
    ],
)
def test_what_ships_places_the_hands_that_it_keeps(fault, where, share):
    hand = KEPT[fault]
    limits = load_limits(kind_of(hand.trial.unit), hand.trial.firmware, guarded=hand.trial.guarded)
    told = diagnose(hand.numbers, limits, Ending())
    assert told.where[0].sentence == where
    assert told.where[0].probability == pytest.approx(share, abs=0.02)
    assert CATALOGUE[parse_fault(fault).name].cause in told.shown
