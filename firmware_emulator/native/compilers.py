"""Which compiler makes a firmware program: one whose `long` has 32 bits, as the chip's has.

The firmware multiplies by `65535L` and lives with the wrap, so that a longer `long` gives other positions.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

SANITIZERS = ("address", "undefined")
ZIG_TARGETS = {"x86_64": "x86-linux-musl", "aarch64": "arm-linux-musleabihf"}
"""32-bit system whose programs a machine runs without any of its libraries."""


class FirmwareBuildError(Exception):
    """A firmware cannot be built; the message says why and what to do."""


@dataclass(frozen=True)
class Compiler:
    """A command, the options that it needs to make a program of 32 bits, and those with which it links one."""

    command: tuple[str, ...]
    options: tuple[str, ...]
    linking: tuple[str, ...]
    long_bits: int = 32


def choose(sanitize: frozenset[str]) -> Compiler:
    """Return the compiler to use: g++ where it makes programs of 32 bits, else the one of the package `ziglang`.

    The address sanitizer needs g++; where that makes 64 bits only, the program finds errors and is no good to compare.

    Raises:
        FirmwareBuildError: none is there.
    """
    if platform.system() != "Linux":
        raise FirmwareBuildError("a firmware program runs on Linux only; use a Linux machine, WSL or a container")
    if _makes_32_bits("address" in sanitize):
        static = () if sanitize else ("-static",)
        return Compiler(("g++",), ("-m32", "-msse2", "-mfpmath=sse"), static)
    if "address" in sanitize:
        if shutil.which("g++") is None:
            raise FirmwareBuildError("--sanitize address needs g++, best with its 32-bit libraries (g++-multilib)")
        return Compiler(("g++",), (), (), long_bits=64)
    if find_spec("ziglang") is None:
        raise FirmwareBuildError(
            "no compiler for 32-bit programs; the extra `firmware` brings one, or install g++-multilib"
        )
    machine = platform.machine()
    if machine not in ZIG_TARGETS:
        raise FirmwareBuildError(f"no 32-bit system is known that a {machine} runs; known are {', '.join(ZIG_TARGETS)}")
    target = ("-target", ZIG_TARGETS[machine])
    return Compiler((sys.executable, "-m", "ziglang", "c++"), target, (*target, "-static"))


@cache
def _makes_32_bits(with_sanitizer: bool) -> bool:
    if shutil.which("g++") is None or platform.machine() != "x86_64":
        return False
    with tempfile.TemporaryDirectory() as folder:
        unit = Path(folder, "long.cpp")
        unit.write_text("#include <string>\nint main() { return sizeof(long) == 4 ? 0 : 1; }\n", encoding="utf-8")
        sanitizer = ["-fsanitize=address,undefined"] if with_sanitizer else []
        command = ["g++", "-m32", *sanitizer, unit.name, "-o", "long"]
        return subprocess.run(command, cwd=folder, capture_output=True, check=False).returncode == 0
