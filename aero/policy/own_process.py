"""Process of a policy that people bring, which `aero.policy.own` starts: its code decides no exit code of ours.

A line in is an observation, a line out is an answer, JSON both. Standard output of the policy's own code goes to
standard error. The process ends with its input, also in the middle of an action.
"""

from __future__ import annotations

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
from pathlib import Path
from queue import SimpleQueue
from types import ModuleType
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from aero.child_process import READY

Actor = Callable[[NDArray[np.float64]], Any]
"""From an observation (n,) to an action (m,)."""
ONNX = ".onnx"
MOST_MEMORY = 2**30
"""Memory that an ONNX model may allocate, bytes."""
MOST_NUMBERS = 1000
"""Longest action that is passed on; of a longer one only the size."""
MOST_CHARACTERS = 300
"""Characters of a message that are passed on."""
LIBRARY = sysconfig.get_path("stdlib")
ENTRIES = 20
"""Last entries of a traceback that are passed on."""


def main(name: str) -> None:
    """Load the policy `name`, print `ready` with the file that its interface lies beside, and answer observations."""
    questions, answers = os.fdopen(os.dup(0), encoding="utf-8"), os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # `input` of the policy would take our lines
    os.dup2(2, 1)

    def answer(content: Any, *, word: str = "") -> None:
        answers.write(f"{word}{json.dumps(content)}\n")
        answers.flush()

    lines: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_take, args=(questions, lines), daemon=True).start()
    try:
        file, make = _onnx(name) if name.endswith(ONNX) else _python(name)
    except BaseException as error:  # also SystemExit of a module
        answer(_failure(error), word=f"{READY} ")
        os._exit(0)  # the thread waits for input
    answer({"file": file}, word=f"{READY} ")
    actor: Actor | None = None
    while True:
        observation = np.array(json.loads(lines.get()), np.float64)
        try:
            actor = make() if actor is None else actor
            answer(_numbers(actor(observation)))
        except BaseException as error:  # also SystemExit and KeyboardInterrupt of a step
            answer(_failure(error))


def _take(questions: TextIO, lines: SimpleQueue[str]) -> None:
    """Queue the lines that come, and end the process with its input."""
    for line in questions:
        lines.put(line)
    os._exit(0)


def _numbers(action: Any) -> dict[str, Any]:
    numbers = np.asarray(action, np.float64)
    shown = numbers.reshape(-1).tolist() if numbers.size <= MOST_NUMBERS else None
    return {"shape": numbers.shape, "action": shown}


def _failure(error: BaseException) -> dict[str, Any]:
    """Return type and message with the place in the policy's own code, and the frames from there on."""
    every = traceback.extract_tb(error.__traceback__)
    own = [k for k, frame in enumerate(every) if _is_own(frame.filename)]
    where = f", {every[own[-1]].filename}:{every[own[-1]].lineno}" if own else ""
    if isinstance(error, SyntaxError) and error.filename:
        where = f", {error.filename}:{error.lineno}"
    try:
        said = f"{type(error).__name__}: {error}"
    except Exception:  # of a __str__ of its own
        said = type(error).__name__
    frames = traceback.format_list(every[own[0] :][-ENTRIES:]) if own else []
    return {"failed": " ".join(said.split())[:MOST_CHARACTERS].rstrip(": ") + where, "frames": frames}


def _is_own(filename: str) -> bool:
    """Return whether a file is neither of Python, nor installed, nor this one."""
    return not (filename == __file__ or filename.startswith(("<", LIBRARY)) or "-packages" in filename)


def _onnx(path: str) -> tuple[str, Callable[[], Actor]]:
    """Return what gives the first output of an ONNX model with one input, (1, n) of either precision."""
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
    """Return the file of a module `package.module:name`, and its factory; the present folder is searched first."""
    name, _, attribute = spec.partition(":")
    here = str(Path.cwd())
    # After the standard library: a `signal.py` that lies there is not meant by any `import signal` of a library.
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
    """Return a module of the folder under a name that Python or this process uses, such as `serial`; None otherwise."""
    spec = PathFinder.find_spec(name, [folder])
    if (name not in sys.modules and name not in sys.stdlib_module_names) or spec is None or spec.loader is None:
        return None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
