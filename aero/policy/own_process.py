"""Process of a user-supplied policy, started by `aero.policy.own`; isolates this program from the policy's code.

Each input line is an observation and each output line an answer, both JSON. The policy's own standard output is
redirected to standard error. The process exits when its input ends, even during an action.
"""

import importlib
import json
import os
import sys
import sysconfig
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from io import TextIOWrapper
from pathlib import Path
from queue import SimpleQueue
from types import ModuleType
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from aero.child_process import READY

Actor = Callable[[NDArray[np.float64]], Any]
"""Function from an observation (n,) to an action (m,)."""
ONNX = ".onnx"
MOST_MEMORY = 2**30
"""Memory limit of an ONNX model, bytes."""
MOST_NUMBERS = 1000
"""Size limit of a forwarded action; of a larger one only the shape is sent."""
MOST_CHARACTERS = 300
"""Length limit of a forwarded message."""
LIBRARY = sysconfig.get_path("stdlib")
ENTRIES = 20
"""Number of last traceback entries forwarded."""


def main(name: str) -> None:
    """Load the policy `name`, print `ready` with the path of its file, and answer observations."""
    questions, answers = os.fdopen(os.dup(0), encoding="utf-8"), os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # `input()` in the policy would read our lines
    os.dup2(2, 1)
    # The process may exit without flushing, when its input ends during an action.
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)

    def answer(content: Any, *, word: str = "") -> None:
        answers.write(f"{word}{json.dumps(content)}\n")
        answers.flush()

    lines: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_take, args=(questions, lines), daemon=True).start()
    try:
        file, make = _onnx(name) if name.endswith(ONNX) else _python(name)
    except BaseException as error:  # also SystemExit raised by a module
        answer(_failure(error), word=f"{READY} ")
        os._exit(0)  # a normal exit would wait for the reader thread
    answer({"file": file}, word=f"{READY} ")
    actor: Actor | None = None
    while True:
        observation = np.array(json.loads(lines.get()), np.float64)
        try:
            actor = make() if actor is None else actor
            answer(_numbers(actor(observation)))
        except BaseException as error:  # also SystemExit and KeyboardInterrupt
            answer(_failure(error))


def _take(questions: TextIO, lines: SimpleQueue[str]) -> None:
    """Queue received lines, and exit the process at the end of input."""
    for line in questions:
        lines.put(line)
    os._exit(0)


def _numbers(action: Any) -> dict[str, Any]:
    numbers = np.asarray(action, np.float64)
    shown = numbers.reshape(-1).tolist() if numbers.size <= MOST_NUMBERS else None
    return {"shape": numbers.shape, "action": shown}


def _failure(error: BaseException) -> dict[str, Any]:
    """Return type and message of an error, its line in the policy's own code, and the traceback from there."""
    every = traceback.extract_tb(error.__traceback__)
    own = [k for k, frame in enumerate(every) if _is_own(frame.filename)]
    where = f", {every[own[-1]].filename}:{every[own[-1]].lineno}" if own else ""
    if isinstance(error, SyntaxError) and error.filename:
        where = f", {error.filename}:{error.lineno}"
    try:
        said = f"{type(error).__name__}: {error}"
    except Exception:  # raised by the error's own __str__
        said = type(error).__name__
    frames = traceback.format_list(every[own[0] :][-ENTRIES:]) if own else []
    return {"failed": " ".join(said.split())[:MOST_CHARACTERS].rstrip(": ") + where, "frames": frames}


def _is_own(filename: str) -> bool:
    """Return whether a file is the user's: not of the standard library, installed, or this module."""
    return not (filename == __file__ or filename.startswith(("<", LIBRARY)) or "-packages" in filename)


def _onnx(path: str) -> tuple[str, Callable[[], Actor]]:
    """Return the path and a loader of an ONNX model: one (1, n) input, of which the first output is used."""
    with suppress(ImportError):  # Windows
        import resource  # noqa: PLC0415

        resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, MOST_MEMORY))
    import onnxruntime  # noqa: PLC0415 - an extra

    onnxruntime.set_default_logger_severity(4)

    def make() -> Actor:
        options = onnxruntime.SessionOptions()
        options.log_severity_level = 4  # errors are raised as well
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

    return path, make


def _python(spec: str) -> tuple[str, Callable[[], Actor]]:
    """Return the file and the factory of `package.module:name`; the current folder precedes installed packages."""
    name, _, attribute = spec.partition(":")
    here = str(Path.cwd())
    # After the standard library, so that a local `signal.py` does not shadow `import signal` of a library.
    library = [k for k, entry in enumerate(sys.path) if entry.startswith(LIBRARY) and "-packages" not in entry]
    sys.path.insert(max(library, default=-1) + 1, here)
    module = _own_module(name, here) or importlib.import_module(name)
    if not hasattr(module, attribute):
        raise AttributeError(f"{name} has no {attribute!r}")
    if getattr(module, "__file__", None) is None:
        raise ImportError(f"{name} is a folder without __init__.py")

    def make() -> Actor:
        made = getattr(module, attribute)()
        if not callable(made):
            raise TypeError(f"the factory must return a callable, from observation to action; got {made!r}")
        return made  # type: ignore[no-any-return]

    return str(module.__file__), make


def _own_module(name: str, folder: str) -> ModuleType | None:
    """Return a module of `folder` with a name already used by Python or this process, such as `serial`, or None."""
    spec = PathFinder.find_spec(name, [folder])
    if (name not in sys.modules and name not in sys.stdlib_module_names) or spec is None or spec.loader is None:
        return None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
