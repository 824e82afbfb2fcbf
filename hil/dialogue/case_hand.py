"""Hand of a case, a dialogue that shows it, and a helper that can do its steps."""

from contextlib import AbstractContextManager
from typing import Protocol

from aero.channels import Channel
from aero.clock import Clock
from hil.dialogue.asker import Asker
from hil.targets.hand_spec import PortSpec
from hil.targets.target import Target
from hil.verdict.group import Proposal
from hil.verdict.noticed import Noticed, Place


class CaseAsker(Asker, Protocol):
    """Dialogue that can also show the hand."""

    def follow(self, target: Target) -> None:
        """Show an opened hand until it is closed."""


class CaseHelper(Protocol):
    """Substitute for the user, to do the steps on an emulated hand."""

    def do(self, proposal: Proposal) -> str:
        """Do a step and return a description of the action."""

    def see(self, proposal: Proposal) -> Noticed:
        """Look, measure or read as a step requires; return the observation."""

    def marked(self, proposal: Proposal) -> Place:
        """Return the place of the servo that a step has marked."""

    def moved(self, channel: Channel) -> Place:
        """Return the digit that moved when a channel was nudged."""


class CaseHand(Protocol):
    """Hand of a case, reopened after each step."""

    @property
    def spec(self) -> PortSpec:
        """Specification of the hand."""

    @property
    def clock(self) -> Clock:
        """Clock of the hand."""

    @property
    def helper(self) -> CaseHelper | None:
        """Helper that can do steps on request, or None."""

    def open(self, *, may_be_silent: bool = False) -> AbstractContextManager[Target]:
        """Open the hand.

        Raises:
            NoHandError: nothing answers, and the hand may not be silent.
        """
