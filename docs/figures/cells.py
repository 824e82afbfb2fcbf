"""Cells of a table: text around figures, and whether a printed cell still says what is measured."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from string import Formatter

NUMBER = r"[-+]?(?:\d+(?:\.\d+)?(?:e[-+]?\d+)?|nan)"


@dataclass(frozen=True)
class Tolerance:
    """How far a figure may be from the printed one before the page has to be written again."""

    reason: str
    """Why this much."""
    last_place: float = 0.0
    """In units of the last printed digit, beyond the half that rounding takes."""
    relative: float = 0.0
    """Part of the printed figure."""
    other_physics: float = 0.0
    """Part of the printed figure that is allowed instead where another MuJoCo measures than the one that is printed."""

    def allows(self, printed: str, measured: float, *, same_physics: bool = True) -> bool:
        """Return whether a figure is printed closely enough; two that are not a number are."""
        value = float(printed)
        if math.isnan(value) or math.isnan(measured):
            return math.isnan(value) and math.isnan(measured)
        digits, _, exponent = printed.partition("e")
        unit = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
        relative = self.relative if same_physics else max(self.relative, self.other_physics)
        # A millionth of a digit is what decimal fractions lose in binary.
        return abs(value - measured) <= (0.5 + 1e-6 + self.last_place) * unit + relative * abs(value)

    def __str__(self) -> str:
        """Say how much, and why."""
        parts = [f"{self.last_place:g} of the last digit"] if self.last_place else []
        parts += [f"{self.relative:.0%}"] if self.relative else []
        parts += [f"{self.other_physics:.0%} with another MuJoCo"] if self.other_physics else []
        return f"{', '.join(parts) or 'none'}: {self.reason}"


@dataclass(frozen=True)
class Cell:
    """Figures in a text, as `str.format` takes them: `Cell.of("{:.2f} ({:.2f})", 0.253, 0.45)`."""

    template: str
    values: tuple[float, ...] = ()

    @classmethod
    def of(cls, template: str, *values: float) -> Cell:
        """Make a cell of a template and its figures."""
        return cls(template, tuple(float(value) for value in values))

    @property
    def text(self) -> str:
        """The cell as it is printed."""
        return re.sub(r"-(0(?:\.0+)?)(?![\d.])", r"\1", self.template.format(*self.values))

    def stands(self, printed: str, tolerance: Tolerance, *, same_physics: bool = True) -> bool:
        """Return whether a printed cell has the same words, and its figures within the tolerance."""
        parts = Formatter().parse(self.template)
        pattern = "".join(re.escape(word) + (f"({NUMBER})" if field is not None else "") for word, field, _, _ in parts)
        found = re.fullmatch(pattern, printed)
        return found is not None and all(
            tolerance.allows(number, value, same_physics=same_physics)
            for number, value in zip(found.groups(), self.values, strict=True)
        )
