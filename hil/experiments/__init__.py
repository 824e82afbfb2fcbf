"""The experiments, in the order in which a hand goes through them: what needs least of it comes first."""

from hil.experiments.audit import AUDIT
from hil.experiments.coupling import COUPLING
from hil.experiments.excursion import EXCURSION
from hil.experiments.experiment import Experiment, Measured
from hil.experiments.holding import HOLDING
from hil.experiments.homing import HOMING
from hil.experiments.open_loop_replay import REPLAY
from hil.experiments.presence import PRESENCE
from hil.experiments.response import RESPONSE
from hil.experiments.staircase.stimulus import STAIRCASE

EXPERIMENTS: dict[str, Experiment] = {
    experiment.name: experiment
    for experiment in (PRESENCE, AUDIT, EXCURSION, RESPONSE, COUPLING, HOLDING, STAIRCASE, REPLAY, HOMING)
}
DEFAULT = tuple(name for name in EXPERIMENTS if name != "homing")
"""Run unless others are asked for."""
GATES = ("presence",)
"""When one of these fails, nothing that moves the hand is run."""

__all__ = ["DEFAULT", "EXPERIMENTS", "GATES", "Experiment", "Measured"]
