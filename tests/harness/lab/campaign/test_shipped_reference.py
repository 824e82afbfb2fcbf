"""What ships says of hands that it was learned from, pinned: the place, its share, and that the cause is shown."""

from pathlib import Path

import pytest

from hil.faults import CATALOGUE, parse_fault
from hil.lab.campaign.kept_readings import DICTIONARY, DRAWN, parse_kept
from hil.lab.campaign.population import kind_of
from hil.verdict.diagnose import diagnose
from hil.verdict.ending import EndSignature
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
        ("late_goals=30.0", "several channels", 0.88),
        ("spring_strong:index=2.0", "index (one channel)", 0.96),
        ("board_restart=1.0@50.1", "board", 0.92),
        ("board_of_other_side=1.0", "board", 0.77),
        ("current_wrong:index=3.48", "index (one channel)", 0.56),
    ],
)
def test_what_ships_places_the_hands_that_it_keeps(fault, where, share):
    hand = KEPT[fault]
    limits = load_limits(kind_of(hand.trial.unit), hand.trial.firmware, guarded=hand.trial.guarded)
    told = diagnose(hand.numbers, limits, EndSignature())
    assert told.where[0].sentence == where
    assert told.where[0].probability == pytest.approx(share, abs=0.02)
    assert CATALOGUE[parse_fault(fault).name].cause in told.shown
