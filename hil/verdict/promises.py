"""What the guard of a hand promises, in signal temporal logic, each once: the table of docs/promises.md.

The formulas are in the language of `sentil`. Signals are those of `hil.verdict.promise_signals`. What is true or false
is `YES` or -`YES`, so that it never is the smallest distance. The margin of a promise is its robustness: how far the
quantity that it names stayed from its bound, in that quantity's unit, and below zero when the promise was broken.

The bounds are the guard's thresholds (`aero.safety.thresholds`) and the time that it takes to look. They are stated
here as numbers on purpose: a threshold that is moved breaks its promise.
"""

from __future__ import annotations

from dataclasses import dataclass

STEP_S = 0.02
"""Time from one sample of a signal to the next, s."""
YES = 1000.0


@dataclass(frozen=True)
class Promise:
    """One of them."""

    name: str
    formula: str
    unit: str
    """Of the margin."""
    scale: float
    """A margin that is comfortable, in that unit: margins of several promises are compared as shares of theirs."""
    words: str
    """The same for people."""
    recorded: bool = True
    """Whether a recording has the signals; the others need the board, the hand or the guard of a test."""

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that the formula speaks of."""
        words = "".join(letter if letter.isalpha() or letter == "_" else " " for letter in self.formula).split()
        return tuple(dict.fromkeys(word for word in words if word not in KEYWORDS))


KEYWORDS = {"always", "eventually", "not", "and", "or", "implies"}
PROMISES = (
    Promise(
        "current",
        "always (not (always[0, 0.5] (current > 4 and fresh > 0 and moving > 0)))",
        "A",
        2.0,
        "No channel draws more than 4 A for 0.5 s, by fresh readings, before the opening begins.",
    ),
    Promise(
        "temperature",
        "always (not (always[0, 1.3] (temperature >= 65 and moving > 0)))",
        "°C",
        20.0,
        "The opening begins within 1.3 s of a reading of 65 °C.",
    ),
    Promise(
        "stale",
        "always (moving > 0 implies stale < 0.5)",
        "s",
        0.5,
        "The opening begins within 0.5 s of the first reading that the next ones only repeat.",
    ),
    Promise(
        "silence",
        "always (moving > 0 implies silence < 2.5)",
        "s",
        2.5,
        "The opening begins within 2.5 s of the first question without any answer.",
    ),
    Promise(
        "beyond",
        "always (not (always[0, 0.4] (beyond > 0.15 and fresh > 0 and moving > 0)))",
        "of the window",
        0.15,
        "No encoder stands 15 % of its window beyond all commands of 2 s for 0.4 s, before the opening begins.",
    ),
    Promise(
        "short",
        "always (not (always[0, 0.4] (short > 0.5 and fresh > 0 and moving > 0)))",
        "of the window",
        0.5,
        "No encoder stands half its window short of all commands of 2 s for 0.4 s, before the opening begins.",
    ),
    Promise(
        "gentle",
        "always (gentle > 0 implies step < 0.0105)",
        "of the window",
        0.0005,
        "Until the hand has opened and reached its first goal, no command goes further than 1.05 % of a window.",
        recorded=False,
    ),
    Promise(
        "asked",
        "always (unasked < 0.5)",
        "commands",
        0.5,
        "The board never carries out a command that neither the program nor its guard has sent.",
        recorded=False,
    ),
    Promise(
        "ending",
        "always (left < 25)",
        "s",
        25.0,
        "Within 25 s of any ending the hand is open and weak, or the person is told to switch it off.",
        recorded=False,
    ),
    Promise(
        "open",
        "always (ended > 0 implies (bent < 25 or told > 0))",
        "degrees",
        25.0,
        "After any ending no joint of a hand that can move is bent by more than 25 degrees, or the person is told.",
        recorded=False,
    ),
)
"""Every promise, those that a recording can be judged by first."""
