"""What every driver of a hand can do, guarded or not."""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.acknowledgement import Centred, Trimmed
from aero.channels import Channel
from aero.protocol import Opcode


class Hand(Protocol):
    """One Aero Hand Open as seven channels in command order.

    `AeroHand` describes each call with its units, ranges and errors; `GuardedHand` says what it adds.
    """

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    @property
    def name(self) -> str:
        """What a person calls the link, for messages."""
        ...

    @property
    def restarts(self) -> int:
        """How often the board has been seen to start."""
        ...

    @property
    def boot_text(self) -> str:
        """What the board has printed at starts seen by this driver."""
        ...

    @property
    def reading_age_s(self) -> float:
        """Time since the last reading was asked for, s."""
        ...

    @property
    def settings_sent(self) -> Mapping[tuple[Opcode, Channel], int]:
        """Limits that the board has acknowledged and not lost since, register units."""
        ...

    def command_codes(self, codes: ArrayLike) -> None:
        """Send every channel to a position, (7,) integers in 0..65535."""
        ...

    def command_codes_blindly(self, codes: ArrayLike) -> None:
        """Send every channel near a position, in bytes that do no harm if the board is out of step."""
        ...

    def command_torques(self, magnitudes: ArrayLike) -> None:
        """Pull every channel closed with a torque, (7,) integers in 0..1000."""
        ...

    def read_codes(self) -> NDArray[np.uint16]:
        """Read positions, (7,) uint16."""
        ...

    def read_currents(self) -> NDArray[np.float64]:
        """Read motor currents, (7,) float, A."""
        ...

    def read_temperatures(self) -> NDArray[np.float64]:
        """Read servo temperatures, (7,) float, °C."""
        ...

    def read_speeds(self) -> NDArray[np.float64]:
        """Read shaft speeds, (7,) float, rad/s."""
        ...

    def set_speed(self, channel: Channel, register_units: int) -> None:
        """Limit one channel's speed, 0..32766 register units."""
        ...

    def set_torque(self, channel: Channel, register_units: int) -> None:
        """Limit one channel's torque, 0..1023 register units."""
        ...

    def knows_limits(self) -> bool:
        """Return whether the board has speed and torque limits."""
        ...

    def knows_calibrate_mid(self) -> bool:
        """Return whether the board knows CALIBRATE_MID."""
        ...

    def trim(self, channel: Channel, degrees: int) -> Trimmed:
        """Shift one channel's extended end by whole degrees."""
        ...

    def calibrate_mid(self, channel: Channel) -> Centred:
        """Make a channel's present position the middle of its servo's turn."""
        ...

    def home(self, timeout_s: float = ...) -> None:
        """Home all channels and wait until the board says that it is done."""
        ...

    def set_id(self, new_id: int, current_limit: int) -> int:
        """Give the only servo on the bus an ID and a current limit; return the ID it had."""
        ...

    def resynchronise(self) -> int:
        """Bring a board that waits for the rest of a broken frame back into step; return the stray bytes it held."""
        ...

    def close(self) -> None:
        """Give the port back."""
        ...
