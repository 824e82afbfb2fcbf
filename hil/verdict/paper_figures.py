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
    """Metric of the staircase that holds the simulator's value; empty when the simulator has none."""
    note: str = ""
    """How ours differs, or why there is none."""


FINGERTIP = "needs a force gauge at the fingertip; the built hand's model is measured in the model's own tests"
FIST = "the whole window is commanded here; the paper's fist posture is not published"
PAPER_TEXT: tuple[PaperFigure, ...] = (
    PaperFigure("Open-and-close cycle", "about 1.2 Hz", "response", "hand", "open_close_rate", "Hz"),
    *(
        PaperFigure(f"{label} excursion", paper, "excursion", label, "fist_travel", "mm", "excursion_model")
        for label, paper in (
            ("index", "44.45 mm, model off by 0.04"),
            ("middle", "44.45 mm, model off by 0.32"),
            ("ring", "44.45 mm, model off by 1.40"),
            ("pinky", "44.45 mm, model off by 0.41"),
        )
    ),
    PaperFigure(
        "Abduction travel", "1871 mrad, model 1746", "excursion", "thumb_abduction", "fist_travel", "mrad",
        "excursion_model", "firmware 0.2.0 gives away 173 mrad at the open end",
    ),
    PaperFigure(
        "CMC flexion travel", "16.57 mm, model off by 5.42", "excursion", "thumb_cmc_flexion", "fist_travel", "mm",
        "excursion_model", FIST,
    ),
    PaperFigure(
        "Flexor travel", "20.64 mm, model off by 6.44", "excursion", "thumb_flexor", "fist_travel", "mm",
        "excursion_model", FIST,
    ),
    PaperFigure(
        "Settled part of the run", "60 %", "staircase", "index", "settled_percent", "%", note="shorter levels"
    ),
    PaperFigure("Worst finger residual", "within 2 % of range", "staircase", "index", "worst_percent", "%"),
    PaperFigure("Worst flexor residual", "7.1 % of range", "staircase", "thumb_flexor", "worst_percent", "%"),
    PaperFigure(
        "Open-loop replay of a finger", "within a millimetre", "replay", "index", "replay_shape", "mm",
        note="after removing the hand's delay",
    ),
    PaperFigure("Repeatability over homings", "3 mm of cable", "homing", "index", "homing_spread", "mm"),
    PaperFigure("Fingertip force", "about 12 N", note=FINGERTIP),
    PaperFigure("Greatest cable tension", "about 66 N", note="needs a load cell; follows from stall torque and spool"),
    PaperFigure("Endurance", "more than 400 000 cycles", note="needs a physical hand and 90 h"),
)  # fmt: skip
"""Figures of the paper's text beyond its validation table."""
