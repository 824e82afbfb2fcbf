"""Observations of a person or a helper at a step, as data; the words on display are made from them."""

from collections.abc import Mapping
from dataclasses import dataclass

from aero.channels import Channel
from hil.checks.shared.subjects import subject_words

SAME = "nothing differs"


@dataclass(frozen=True)
class Differences:
    """Differences found by bending, looking or reading, by place; an empty tuple for none."""

    act: str
    """Act in the past tense, such as `bent`."""
    of: Mapping[str, tuple[str, ...]]

    def __str__(self) -> str:
        """Return the findings of each place."""
        return "; ".join(f"{self.act} {place}: {', '.join(found) or SAME}" for place, found in self.of.items())


@dataclass(frozen=True)
class Removed:
    """Objects taken out of the hand."""

    any: bool

    def __str__(self) -> str:
        """Return whether there were any."""
        return "took everything out of the hand" if self.any else "there was nothing to take out of the hand"


@dataclass(frozen=True)
class Voltages:
    """Voltages at the board, V."""

    open: float
    closing: float
    usual: float
    """Voltage that the supply should give."""

    def __str__(self) -> str:
        """Return the voltages."""
        return (
            f"{self.open:.2f} V with the hand open, {self.closing:.2f} V while the fingers close; "
            f"the supply gives {self.usual:.2f} V"
        )


@dataclass(frozen=True)
class Flashed:
    """Firmware version and side on the board, and those named."""

    version: str
    side: str
    named_version: str
    named_side: str

    def __str__(self) -> str:
        """Return both."""
        return (
            f"flashed: {self.version}, for a {self.side} hand; "
            f"named: {self.named_version}, for a {self.named_side} hand"
        )


@dataclass(frozen=True)
class Place:
    """Place of a marked servo, or the digit that moved; None for none."""

    channel: Channel | None

    def __str__(self) -> str:
        """Return the digit's name."""
        return "none" if self.channel is None else subject_words(self.channel.label)


Noticed = Differences | Removed | Voltages | Flashed | Place
"""Observation at a step."""
