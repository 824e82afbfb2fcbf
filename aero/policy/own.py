"""Policies that people bring: an ONNX file, or a Python factory; with its interface in a TOML file beside it."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from aero.policy.file import Policy
from aero.policy.interface import Interface, PolicyFileError
from aero.policy.task import ShownAction

Actor = Callable[[NDArray[np.float64]], Any]
"""From an observation (n,) to an action (m,)."""
ONNX = ".onnx"


@dataclass
class OwnNetwork:
    """What people bring, with its answers checked: what does not fit is one line."""

    name: str
    """`FILE.onnx` or `package.module:factory`."""
    interface: Interface

    @cached_property
    def _actor(self) -> Actor:
        return _onnx(self.name) if self.name.endswith(ONNX) else _python(self.name)

    def __getstate__(self) -> dict[str, Any]:
        """Leave the actor out: a session cannot go to another process, so each makes its own."""
        return {"name": self.name, "interface": self.interface}

    def act(self, observation: ArrayLike) -> NDArray[np.float64]:
        """Return the action (m,) for an observation (n,).

        Raises:
            PolicyFileError: the policy failed, or its answer has another size or is not finite.
        """
        try:
            action = np.asarray(self._actor(np.asarray(observation, np.float64)), np.float64).reshape(-1)
        except ModuleNotFoundError:
            raise  # a missing extra has a line of its own
        except Exception as error:
            said = " ".join(str(error).split())
            raise PolicyFileError(f"{self.name} failed on an observation of {np.size(observation)}: {said}") from error
        if action.shape != (self.interface.action_size,):
            raise PolicyFileError(
                f"{self.name} returns {action.size} numbers; its interface names {self.interface.action_size} actions"
            )
        if not np.isfinite(action).all():
            raise PolicyFileError(f"{self.name} returned {action.tolist()}: an action is finite")
        return action


def _onnx(path: str) -> Actor:
    """Return the first output of an ONNX model with one input, (1, n) of either precision."""
    import onnxruntime  # noqa: PLC0415 - an extra

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1  # a small network; more threads would only disturb the loop
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    inputs = session.get_inputs()
    if len(inputs) != 1:
        raise ValueError(f"a model has one input, the observation; this one has {[one.name for one in inputs]}")
    precision = np.float64 if inputs[0].type == "tensor(double)" else np.float32

    def act(observation: NDArray[np.float64]) -> Any:
        (action, *_) = session.run(None, {inputs[0].name: observation[np.newaxis].astype(precision)})
        return action[0]

    return act


def _python(spec: str) -> Actor:
    """Return what a factory `package.module:name` makes."""
    made = getattr(imported(spec), spec.partition(":")[2])()
    if not callable(made):
        raise TypeError(f"the factory must return a callable, from observation to action; got {made!r}")
    return made  # type: ignore[no-any-return]


def is_own(name: str) -> bool:
    """Return whether a name is that of an ONNX file or of a Python factory."""
    return name.endswith(ONNX) or (":" in name and not Path(name).exists())


def load_own(name: str) -> Policy:
    """Return the policy `FILE.onnx` or `package.module:factory`, tried once on an observation of zeros.

    Raises:
        PolicyFileError: it or its interface cannot be read, or they do not fit each other.
        ModuleNotFoundError: onnxruntime is not installed.
    """
    if name.endswith(ONNX):
        if not Path(name).is_file():
            raise PolicyFileError(f"there is no policy {name!r}")
        beside = Path(name).with_suffix(".toml")
    else:
        module = imported(name)
        if not hasattr(module, name.partition(":")[2]):
            raise PolicyFileError(f"{name}: {module.__name__} has no {name.partition(':')[2]!r}")
        beside = Path(str(module.__file__)).with_suffix(".toml")
    interface = Interface.load(beside)
    network = OwnNetwork(name, interface)
    network.act(np.zeros(interface.observation_size))
    return Policy(Path(name).name, network, interface.settings(), ShownAction.LAST, declared=interface)


def imported(spec: str) -> Any:
    """Return the module of `package.module:factory`, looked for in the present folder, too.

    Raises:
        PolicyFileError: there is none, or it cannot be imported.
    """
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.insert(0, here)  # as `python -m` has it; the command line's own path is where it is installed
    module = spec.partition(":")[0]
    try:
        return importlib.import_module(module)
    except Exception as error:
        raise PolicyFileError(f"{spec}: {module} cannot be imported ({type(error).__name__}: {error})") from error
