"""Process of a user-supplied policy, started by `aero.policy.own`; isolates this program from the policy's code.

Each input line is a numbered observation and each output line an answer with its number, both JSON; answer 0 is the
path of the policy's file. The policy's own standard output is redirected to standard error. The end of the input
interrupts an action, and the process then exits as any program does: exit handlers run and files are flushed.
"""

import _thread
import atexit
import importlib
import json
import os
import signal
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
from typing import Any

import numpy as np
from numpy.typing import NDArray

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


class _Line:
    """Pipes to the program that runs the policy, for this process alone."""

    def __init__(self, exit_s: float) -> None:
        """Take standard input and output away from the policy; `exit_s` as for `main`."""
        self._exit_s = exit_s
        self._questions, self._answers = os.fdopen(os.dup(0), encoding="utf-8"), os.dup(1)
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._owner = os.getpid()
        self._busy = threading.Event()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # `input()` in the policy would read our lines
        os.dup2(2, 1)
        if hasattr(os, "register_at_fork"):  # Windows
            os.register_at_fork(after_in_child=self._release)

    def listen(self) -> None:
        """Receive lines from now on; their end interrupts the work in progress."""
        self._busy.set()
        threading.Thread(target=self._take, daemon=True).start()

    def question(self) -> tuple[int, NDArray[np.float64]] | None:
        """Return the next observation and its number, or None at the end of the input."""
        self._busy.clear()
        line = self._lines.get()
        self._busy.set()
        if line is None:
            return None
        asked = json.loads(line)
        return asked["question"], np.array(asked["observation"], np.float64)

    def answer(self, question: int, content: dict[str, Any]) -> None:
        """Answer a question; a forked copy of this process, which has returned from the policy too, exits instead."""
        if os.getpid() != self._owner:
            os._exit(0)
        left = memoryview(f"{json.dumps({'question': question} | content)}\n".encode())
        try:
            while left:
                left = left[os.write(self._answers, left) :]
        except OSError:  # the end of the input follows, unless the policy has closed the descriptor
            self._lines.put(None)

    def _take(self) -> None:
        with suppress(OSError, ValueError):  # the policy has closed our descriptors
            for line in self._questions:
                self._lines.put(line)
        if self._busy.is_set():
            _interrupt_main()
        self._lines.put(None)
        threading.Event().wait(self._exit_s)
        _end_group(signal.SIGKILL)
        os._exit(1)

    def _release(self) -> None:
        """Close the pipes in a forked copy, which would otherwise keep them open after this process."""
        for descriptor in (self._questions.fileno(), self._answers):
            with suppress(OSError):
                os.close(descriptor)


def main(name: str, exit_s: float) -> None:
    """Load the policy `name`, answer with the path of its file, then answer observations until the input ends.

    Args:
        name: `FILE.onnx` or `package.module:factory`.
        exit_s: time to exit after the end of the input, s; then the process and its group are killed.
    """
    line = _Line(exit_s)
    # The process may be killed without flushing.
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background of a shell
    atexit.register(_leave)  # before all handlers of the policy, so that it runs after them
    with suppress(KeyboardInterrupt):  # at the end of the input
        line.listen()
        make: Callable[[], Actor] | None = None
        try:
            file, make = _onnx(name) if name.endswith(ONNX) else _python(name)
            line.answer(0, {"file": file})
        except BaseException as error:  # also SystemExit raised by a module
            line.answer(0, _failure(error))
        actor: Actor | None = None
        while (asked := line.question()) is not None and make is not None:
            number, observation = asked
            try:
                actor = make() if actor is None else actor
                line.answer(number, _numbers(actor(observation)))
            except BaseException as error:  # also SystemExit and KeyboardInterrupt
                line.answer(number, _failure(error))


def _interrupt_main() -> None:
    """Raise KeyboardInterrupt in the main thread, even during a system call."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
    else:  # Windows
        _thread.interrupt_main()


def _leave() -> None:
    """Ask the processes that the policy started to end."""
    if hasattr(signal, "SIGTERM"):
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        _end_group(signal.SIGTERM)


def _end_group(number: int) -> None:
    """Send a signal to the group of this process, if it leads one."""
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(0, number)


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
    library = [entry for entry in sys.path if entry.startswith(LIBRARY) and "-packages" not in entry]
    sys.path.insert(sys.path.index(library[-1]) + 1 if library else 0, here)
    module = _own_module(name, here, library) or importlib.import_module(name)
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


def _own_module(name: str, folder: str, library: list[str]) -> ModuleType | None:
    """Return a module of `folder` whose name Python's library or this process uses too, such as `serial`, or None."""
    top, _, inner = name.partition(".")
    spec = PathFinder.find_spec(top, [folder])
    if spec is None or spec.loader is None:
        return None
    loaded = top in sys.modules
    if (loaded and inner) or not (loaded or PathFinder.find_spec(top, library)):
        return None
    module = module_from_spec(spec)
    if not loaded and top not in sys.stdlib_module_names:  # such as `test`, which no library imports
        sys.modules[top] = module
    spec.loader.exec_module(module)
    return importlib.import_module(name) if inner else module
