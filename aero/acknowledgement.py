"""What a board says after a trim and after CALIBRATE_MID: replies in, values out.

Source: aero-open-firmware d7bd82e; aero-hand-open dd91e5a (`main`), which added the second half of each.
"""

from __future__ import annotations

from typing import NamedTuple

from aero.protocol import Reply

UNREAD = 0xFFFF
"""Position word when the board could not read the servo, or a step before it failed."""


class Trimmed(NamedTuple):
    """The acknowledgement of a trim."""

    extend_counts: int
    """The extended end of the channel's window, servo counts 0..4095."""
    position_counts: int | None
    """Where the servo stands, counts 0..4095. None with firmware before `main`, and where the servo reads below 0; a
    servo that did not answer comes out as 1."""


class Centred(NamedTuple):
    """The acknowledgement of a calibration."""

    position_counts: int
    """Where the servo stands now, counts 0..4095; about 2048."""
    code: int
    """The same place as a position code, 0..65535."""
    near_middle: bool
    """Whether the board takes it for the middle, 2000 to 2096 counts."""


def trimmed(reply: Reply) -> Trimmed:
    """Take the acknowledgement of a trim apart; its fifth word is the version of the longer form, 0 without one."""
    _, extend, position, _, version = reply.words[:5]
    return Trimmed(extend, position if version and position != UNREAD else None)


def centred(reply: Reply) -> Centred | None:
    """Take the acknowledgement of a calibration apart; None when the board refused it or a step failed."""
    _, position, code, far = reply.words[:4]
    return None if position == UNREAD else Centred(position, code, far == 0)
