"""Kinds of bus servo as data: what differs between their memory tables.

Sources: the transcribed HLS and STS memory tables (vassar-robotics/feetech-servo-sdk 8b7d65f, a76c089,
`docs/reference/memory_tables`); numbers, baud rates and the offset's sign bit of the STS3215 as LeRobot 0.4.4 has them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class ServoModel:
    """One kind of servo."""

    name: str
    """As its maker writes it."""
    baud_rates: tuple[int, ...]
    """Baud rates by the value of the baud register, bit/s."""
    offset_sign_bit: int
    """Bit of the position offset register that holds its sign."""
    secondary_id: bool
    """Whether register 7 is a second ID that takes writes; elsewhere it is a delay of answers, which has no effect."""
    overload: bool
    """Whether registers 34 to 36 are holding torque, protection time and overload torque."""
    middle_by_torque: bool
    """Whether 128 in the torque register makes the present position 2048, as CALIBRATE does."""
    factory: Mapping[str, int] = field(default_factory=dict)
    """Factory values that differ from those of the register map, by name."""


HLS3606M = ServoModel(
    "HLS3606M",
    baud_rates=(1_000_000, 500_000, 250_000, 128_000, 115_200, 76_800, 57_600, 38_400),
    offset_sign_bit=15,
    secondary_id=True,
    overload=False,
    middle_by_torque=False,
)
"""The hand's servo: model number 2570, firmware 3.43."""
STS3215 = ServoModel(
    "STS3215",
    baud_rates=(1_000_000, 500_000, 250_000, 128_000, 115_200, 57_600, 38_400, 19_200),
    offset_sign_bit=11,
    secondary_id=False,
    overload=True,
    middle_by_torque=True,
    factory={
        "firmware_minor": 10,
        # Model number 777, low byte first.
        "model_major": 9,
        "model_minor": 3,
        "max_torque": 1000,
        "protection_current": 511,
        "current_p": 20,
        "current_i": 200,
        "reserved_36": 80,
    },
)
"""LeRobot's servo, with the registers in which it differs; its motor here is still that of the unit."""

MODELS: Mapping[str, ServoModel] = {model.name: model for model in (HLS3606M, STS3215)}
"""Every model by name."""


def model_of(name: str) -> ServoModel:
    """Return the model of a name.

    Raises:
        ValueError: no such model.
    """
    if name not in MODELS:
        raise ValueError(f"unknown servo model {name!r}; known are {', '.join(MODELS)}")
    return MODELS[name]
