"""Opening of the hand selected by a configuration."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from hil.emulated.any_hand import open_target
from hil.emulated.emulated_spec import named_spec
from hil.emulated.faults import parse_fault
from hil.targets.hand_errors import FaultNeverFiredError
from hil.targets.hand_spec import PortSpec
from hil.targets.target import Target
from lerobot_robot_aero.config import EMULATED, ChosenHandConfig

_LOG = logging.getLogger(__name__)


def spec_of(chosen: ChosenHandConfig) -> PortSpec:
    """Return the hand of a configuration; entries in `hands.toml` override defaults.

    Raises:
        ValueError: an unknown name, side or firmware.
    """
    port = "pty" if chosen.port == EMULATED else chosen.port
    return named_spec(port, firmware=chosen.firmware, side=chosen.side, unit=chosen.unit, seed=chosen.seed)


@contextmanager
def opened(chosen: ChosenHandConfig, *, guarded: bool) -> Iterator[Target]:
    """Open a hand in real time; an emulated one runs in a separate process, shielded from Ctrl-C.

    A fault without effect only causes a warning, because the length of a data set is unknown in advance.

    Raises:
        ValueError: an unknown firmware, unit or fault; a fault of a hand on a port.
        NoHandError: nothing answers at the port.
        SafetyStopError: on exit, the hand may not be open; the message says what to do.
    """
    try:
        faults = tuple(map(parse_fault, chosen.fault.split()))
        with open_target(spec_of(chosen), faults=faults, guarded=guarded) as target:
            yield target
    except FaultNeverFiredError as error:
        _LOG.warning("%s", error)
