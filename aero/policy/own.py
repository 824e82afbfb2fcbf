"""User-supplied policies: an ONNX file or a Python factory, with the interface in a TOML file beside it.

Each policy runs in its own process, so its exceptions, exit, output and modules cannot affect this program. Actions
have a time limit, and an ONNX file a memory limit. The process has the rights of the user; run only trusted policies.
"""

import json
import signal
import sys
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.child_process import ChildError, ChildProcess, ChildTimeoutError, python
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
EXIT_S = 3.0
"""Time for the process to exit after the end of its input, s; it then kills itself."""
SOURCE = ".py"
MOST_SHOWN = 80
"""Number of characters of foreign output in a message."""


@dataclass
class OwnNetwork:
    """Client of a user-supplied policy's process; checks every action and raises one-line errors."""

    name: str
    """`FILE.onnx` or `package.module:factory`."""
    interface: Interface | None = None
    """Interface of the policy; None until its file is known."""
    _patience_s: float = START_S
    """Time-out of the next action, s."""
    _asked: int = 0
    """Number of the last question."""

    @cached_property
    def _process(self) -> ChildProcess:
        code = f"from aero.policy.own_process import main; main({self.name!r}, {EXIT_S})"
        process = ChildProcess(python(code), self.name, on_error=_show)
        weakref.finalize(self, _end, process, self.name)
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
        return Path(self._answer(0, START_S, "cannot be loaded")["file"])

    def end(self) -> None:
        """End the process after all of its output has been shown; its exit handlers run."""
        _end(self._process, self.name)

    def act(self, observation: ArrayLike) -> NDArray[np.float64]:
        """Return the action (m,) for an observation (n,).

        Raises:
            PolicyFileError: the policy failed or timed out, or its action has a wrong size or is not finite.
        """
        assert self.file
        assert self.interface is not None
        row = np.asarray(observation, np.float64).reshape(-1)
        self._asked += 1
        try:
            self._process.send(json.dumps({"question": self._asked, "observation": row.tolist()}) + "\n")
        except (BrokenPipeError, ValueError) as error:
            raise self._ended() from error
        answer = self._answer(self._asked, self._patience_s, f"failed on an observation of {row.size}")
        self._patience_s = max(STEP_S, PERIODS / self.interface.rate_hz)
        shape, action = answer["shape"], answer["action"]
        size, wanted = int(np.prod(shape)), self.interface.action_size
        if size != wanted:
            chunk = f", an array {tuple(shape)}" if len(shape) > 1 else ""
            raise PolicyFileError(f"{self.name} returns {size} numbers{chunk}; its interface names {wanted} actions")
        if not np.isfinite(action).all():
            raise PolicyFileError(f"{self.name} returned {action}: an action is finite")
        return np.array(action)

    def _answer(self, question: int, timeout_s: float, what: str) -> dict[str, Any]:
        """Return the answer to a question; late answers to earlier ones are dropped.

        Raises:
            PolicyFileError: no answer, a foreign line, or a failure, with the policy's traceback as a note.
        """
        while True:
            try:
                # Not killed here, because the hand is opened first, and the process may still write its files.
                line = self._process.read_line(timeout_s, kills=False)
            except ChildTimeoutError as error:
                raise PolicyFileError(f"{self.name} did not answer within {timeout_s:g} s") from error
            except ChildError as error:
                raise self._ended() from error
            answer = _parsed(line)
            if answer is None:
                raise PolicyFileError(
                    f"{self.name} wrote to the descriptor of its answers, which it did not open: {line[:MOST_SHOWN]!r}"
                )
            if answer["question"] == question:
                break
        if "failed" not in answer:
            return answer
        failure = PolicyFileError(f"{self.name} {what}: {answer['failed']}")
        if answer["frames"]:
            failure.add_note("".join(("in the policy (most recent call last):\n", *answer["frames"])).rstrip())
        raise failure

    def _ended(self) -> PolicyFileError:
        return PolicyFileError(f"{self.name} did not answer: its process has ended")


@contextmanager
def ended(policy: Policy) -> Iterator[None]:
    """End the process of a user-supplied policy after the block."""
    try:
        yield
    finally:
        if isinstance(policy.network, OwnNetwork):
            policy.network.end()


ANSWERS = ({"question", "file"}, {"question", "shape", "action"}, {"question", "failed", "frames"})
"""Keys of the answers of `aero.policy.own_process`."""


def _parsed(line: str) -> dict[str, Any] | None:
    """Return an answer, or None for a line of other origin."""
    try:
        answer = json.loads(line)
    except (ValueError, RecursionError):
        return None
    return answer if isinstance(answer, dict) and answer.keys() in ANSWERS else None


def _end(process: ChildProcess, name: str) -> None:
    running = process.running
    try:
        # A second more, because the process kills itself in time, even without this program.
        status = process.end(EXIT_S + 1.0, last_words="")
    except ChildTimeoutError:
        status = -signal.SIGKILL
    if running and status == -signal.SIGKILL:
        _show(f"{name} did not exit within {EXIT_S:g} s and was killed; files that it wrote may be incomplete")


def _show(line: str) -> None:
    print(printable(line), file=sys.stderr)


def is_own(name: str) -> bool:
    """Return whether `name` denotes an ONNX file, Python source or a Python factory."""
    return name.endswith((ONNX, SOURCE)) or (":" in name and not Path(name).exists())


def load_own(name: str) -> Policy:
    """Return the policy `FILE.onnx` or `package.module:factory` after a test run on an observation of zeros.

    Raises:
        PolicyFileError: unreadable policy or interface, or a mismatch between them.
    """
    if (source := name.partition(":")[0]).endswith(SOURCE):
        module = ".".join(Path(source).with_suffix("").parts)
        raise PolicyFileError(f"{source} is Python source; name a factory in it as {module}:make")
    if name.endswith(ONNX):
        if not Path(name).is_file():
            raise PolicyFileError(f"there is no policy {name!r}")
        if find_spec("onnxruntime") is None:
            raise PolicyFileError("an ONNX file needs the extra `onnx`; from a checkout: pip install -e '.[onnx]'")
    network = OwnNetwork(name)
    interface = network.interface = Interface.load(network.file.with_suffix(".toml"))
    network.act(np.zeros(interface.observation_size))
    return Policy(Path(name).name, network, interface.settings(), ShownAction.LAST, declared=interface)
