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
