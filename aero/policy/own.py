"""User-supplied policies: an ONNX file or a Python factory, with the interface in a TOML file beside it.

Each policy runs in its own process, so its exceptions, exit, output and modules cannot affect this program. Actions
have a time limit, and an ONNX file a memory limit. The process has the rights of the user; run only trusted policies.
"""

import json
import sys
import weakref
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.child_process import KILL_S, ChildError, ChildProcess, python
from aero.policy.file import Policy
from aero.policy.interface import Interface, PolicyFileError
from aero.policy.own_process import ONNX
from aero.policy.task import ShownAction
from aero.printable import printable

START_S = 60.0
"""Time-out of a policy's imports, and of its first action, which may compile, s."""
STEP_S = 2.0
"""Time-out of later actions, s, or `PERIODS` control periods if longer."""
PERIODS = 4


@dataclass
class OwnNetwork:
    """Client of a user-supplied policy's process; checks every action and raises one-line errors."""

    name: str
    """`FILE.onnx` or `package.module:factory`."""
    interface: Interface | None = None
    """Interface of the policy; None until its file is known."""
    _patience_s: float = START_S
    """Time-out of the next action, s."""

    @cached_property
    def _process(self) -> ChildProcess:
        code = f"from aero.policy.own_process import main; main({self.name!r})"
        process = ChildProcess(python(code), self.name, on_error=_show)
        weakref.finalize(self, process.kill)
        return process

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the process; an unpickled copy starts its own."""
        return {"name": self.name, "interface": self.interface}

    @cached_property
    def file(self) -> Path:
        """Path of the policy's own file; the interface file is beside it.

        Raises:
            PolicyFileError: the policy cannot be loaded.
        """
        try:
            started = json.loads(self._process.wait_ready(START_S))
        except ChildError as error:
            raise self._ended(error) from error
        return Path(self._well(started, "cannot be loaded")["file"])

    def end(self) -> None:
        """End the process after all of its output has been shown."""
        self._process.end(KILL_S, last_words="")

    def act(self, observation: ArrayLike) -> NDArray[np.float64]:
        """Return the action (m,) for an observation (n,).

        Raises:
            PolicyFileError: the policy failed or timed out, or its action has a wrong size or is not finite.
        """
        assert self.file
        assert self.interface is not None
        row = np.asarray(observation, np.float64).reshape(-1)
        try:
            self._process.send(json.dumps(row.tolist()) + "\n")
            answer = json.loads(self._process.read_line(self._patience_s))
        except (ChildError, BrokenPipeError) as error:
            raise self._ended(error) from error
        self._patience_s = max(STEP_S, PERIODS / self.interface.rate_hz)
        shape, action = self._well(answer, f"failed on an observation of {row.size}")["shape"], answer["action"]
        size, wanted = int(np.prod(shape)), self.interface.action_size
        if size != wanted:
            chunk = f", an array {tuple(shape)}" if len(shape) > 1 else ""
            raise PolicyFileError(f"{self.name} returns {size} numbers{chunk}; its interface names {wanted} actions")
        if not np.isfinite(action).all():
            raise PolicyFileError(f"{self.name} returned {action}: an action is finite")
        return np.array(action)

    def _well(self, answer: dict[str, Any], what: str) -> dict[str, Any]:
        """Return `answer`; for a failure raise PolicyFileError with the policy's traceback as a note."""
        if "failed" not in answer:
            return answer
        error = PolicyFileError(f"{self.name} {what}: {answer['failed']}")
        if answer["frames"]:
            error.add_note("".join(("in the policy (most recent call last):\n", *answer["frames"])).rstrip())
        raise error

    def _ended(self, error: Exception) -> PolicyFileError:
        said = str(error).partition("\n")[0] if isinstance(error, ChildError) else f"{self.name} did not answer"
        return PolicyFileError(said if " within " in said else f"{said}: its process has ended")


def _show(line: str) -> None:
    print(printable(line), file=sys.stderr)


def is_own(name: str) -> bool:
    """Return whether `name` denotes an ONNX file or a Python factory."""
    return name.endswith(ONNX) or (":" in name and not Path(name).exists())


def load_own(name: str) -> Policy:
    """Return the policy `FILE.onnx` or `package.module:factory` after a test run on an observation of zeros.

    Raises:
        PolicyFileError: unreadable policy or interface, or a mismatch between them.
    """
    if name.endswith(ONNX):
        if not Path(name).is_file():
            raise PolicyFileError(f"there is no policy {name!r}")
        if find_spec("onnxruntime") is None:
            raise PolicyFileError("an ONNX file needs the extra `onnx`; from a checkout: pip install -e '.[onnx]'")
    network = OwnNetwork(name)
    interface = network.interface = Interface.load(network.file.with_suffix(".toml"))
    network.act(np.zeros(interface.observation_size))
    return Policy(Path(name).name, network, interface.settings(), ShownAction.LAST, declared=interface)
