"""What the paper published about simulator and hardware; the one home of these figures.

Source of every number: the paper's table "Sim-to-real validation of the transmission model" and the sections
"Kinematic validation" and "Dynamic validation".
"""

from __future__ import annotations

from dataclasses import dataclass

from aero.channels import Channel


@dataclass(frozen=True)
class PaperRow:
    """One channel; lengths in mm for a cable, mrad for the abduction."""

    excursion_difference: float
    """Magnitude of model less hardware, from the extended hand to a fist."""
    excursion_hand: float
    """Of the hardware; for the two thumb cables it follows from the published difference in per cent."""
    tracking_rms: float
    rise_model_ms: float
    rise_hand_ms: float


PAPER: dict[Channel, PaperRow] = {
    Channel.INDEX: PaperRow(0.04, 44.45, 0.45, 90.0, 120.0),
    Channel.MIDDLE: PaperRow(0.32, 44.45, 0.39, 90.0, 120.0),
    Channel.RING: PaperRow(1.40, 44.45, 0.39, 90.0, 120.0),
    Channel.PINKY: PaperRow(0.41, 44.45, 0.29, 90.0, 120.0),
    Channel.THUMB_ABDUCTION: PaperRow(124.94, 1871.0, 26.79, 70.0, 80.0),
    Channel.THUMB_CMC_FLEXION: PaperRow(5.42, 16.57, 0.11, 40.0, 80.0),
    Channel.THUMB_FLEXOR: PaperRow(6.44, 20.64, 0.63, 60.0, 100.0),
}
"""By channel."""


@dataclass(frozen=True)
class PaperFigure:
    """A number of the paper's text, and which measurement of ours stands beside it."""

    name: str
    paper: str
    """As published, with unit."""
    experiment: str = ""
    """Experiment whose measurement corresponds; empty when none does."""
    subject: str = ""
    metric: str = ""
    unit: str = ""
    model: str = ""
    """Metric of the same experiment that holds the simulator's value; empty when the simulator has none."""
    note: str = ""
    """How ours differs, or why there is none."""


FORCE = (
    "needs a force gauge; the built hand gives 13.5 N on a finger, and on the thumb 17.7 N by its flexor or 7.9 N by "
    "its CMC flexion cable, which the paper does not tell apart: `pytest tests/model/test_fingertip_force.py`"
)
CYCLE = (
    "behind the motion profile of firmware pre, whose acceleration the paper's rise times fix, the stroke takes 0.9 s; "
    "1.2 Hz needs a version without it"
)
CLOSURES = (
    "an emulated hand comes back to the count (0.014 mm); creep, wear and play of a physical hand, which the paper's "
    "3 mm hold, are not modelled"
)


def _excursions() -> tuple[PaperFigure, ...]:
    """Return two figures a channel: the hand's way from open to a fist, and the simulator's less the hand's."""
    found = []
    for channel, row in PAPER.items():
        unit = "mrad" if channel is Channel.THUMB_ABDUCTION else "mm"
        name = channel.label.replace("_", " ").capitalize()
        hand, model, difference = "fist_travel", "fist_travel_model", "fist_difference"
        found += [
            PaperFigure(
                f"{name}, open to fist", f"{row.excursion_hand:g} {unit}", "excursion", channel.label, hand, unit, model
            ),
            PaperFigure(
                f"{name}, excursion |Δ|", f"{row.excursion_difference:g} {unit}", "excursion", channel.label,
                difference, unit,
            ),
        ]  # fmt: skip
    return tuple(found)


PAPER_TEXT: tuple[PaperFigure, ...] = (
    PaperFigure("Open-and-close cycle", "about 1.2 Hz", "response", "hand", "open_close_rate", "Hz", note=CYCLE),
    *_excursions(),
    PaperFigure(
        "Settled part of the run", "60 %", "staircase", "index", "settled_percent", "%", note="shorter levels"
    ),
    PaperFigure("Worst finger residual", "within 2 % of range", "staircase", "index", "worst_percent", "%"),
    PaperFigure("Worst flexor residual", "7.1 % of range", "staircase", "thumb_flexor", "worst_percent", "%"),
    PaperFigure(
        "Open-loop replay of a finger", "within a millimetre", "replay", "index", "replay_shape", "mm",
        note="after removing the hand's delay",
    ),
    PaperFigure(
        "Repeated closures to one posture", "within 3 mm of cable", "repeatability", "index", "closure_spread", "mm",
        note=CLOSURES,
    ),
    PaperFigure("Fingertip force", "about 12 N, each finger and the thumb", note=FORCE),
    PaperFigure("Greatest cable tension", "about 66 N", note="needs a load cell; follows from stall torque and spool"),
    PaperFigure("Endurance", "more than 400 000 cycles", note="needs a physical hand and 90 h"),
)  # fmt: skip
"""Figures of the paper's text beyond the table of its dynamic validation."""
