"""Build of a firmware program from the user's sketch, the servo library and the host board of this package."""

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from firmware_emulator.native.sketch import HEADERS, UNITS, SketchError, translated

# Programs must be 32-bit: the firmware multiplies by `65535L` and relies on the wrap of a 32-bit `long`.
SANITIZERS = ("address", "undefined")
ZIG_TARGETS = {"x86_64": "x86-linux-musl", "aarch64": "arm-linux-musleabihf"}
"""Target triple of statically linked 32-bit programs, by machine."""


class FirmwareBuildError(Exception):
    """Failed firmware build; the message names cause and remedy."""


@dataclass(frozen=True)
class Compiler:
    """Compiler command with its options for compiling and linking a 32-bit program."""

    command: tuple[str, ...]
    options: tuple[str, ...]
    linking: tuple[str, ...]
    long_bits: int = 32


def choose(sanitize: frozenset[str]) -> Compiler:
    """Return the compiler to use: g++ if it can build 32-bit programs, else that of the package `ziglang`.

    The address sanitizer requires g++. A 64-bit program finds errors, but is unsuitable for comparisons.

    Raises:
        FirmwareBuildError: no suitable compiler is installed.
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


HOST = Path(__file__).parent / "host"
STANDARD = ("-std=gnu++17", "-funsigned-char", "-fwrapv", "-pthread", "-w")
"""Compiler options that match the chip: unsigned characters, wrapping signed overflow."""
DEFINES = ("ARDUINO=10819", "ESP32", "ARDUINO_ARCH_ESP32", "CONFIG_IDF_TARGET_ESP32S3=1", "ARDUINO_USB_CDC_ON_BOOT=1")


def build(
    source: Path,
    out: Path,
    *,
    library: Path | None = None,
    side: str | None = None,
    sanitize: Iterable[str] = (),
    defines: Sequence[str] = (),
) -> Compiler:
    """Build a program and return the compiler used.

    Objects of the host board and the library are cached in the user's cache folder, so a second build compiles only
    the sketch.

    Args:
        source: folder of the sketch.
        out: program file to write.
        library: folder of the servo library, FTServo_Arduino; None if the sketch contains the library.
        side: `right` or `left`, overrides the choice in `HandConfig.h`; None keeps the choice.
        sanitize: subset of `SANITIZERS`; the program stops at the first error with file and line.
        defines: additional macros for the sketch, `NAME` or `NAME=VALUE`.

    Raises:
        FirmwareBuildError: no compiler, no sketch, or a compiler error, quoted in the message.
    """
    wanted = frozenset(sanitize)
    if unknown := wanted - set(SANITIZERS):
        raise FirmwareBuildError(f"unknown sanitizer {', '.join(sorted(unknown))}; known are {', '.join(SANITIZERS)}")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        # Arguments are checked first, so that their errors are reported even without a compiler.
        try:
            units = translated(source, folder / "sketch", side=side)
        except SketchError as error:
            raise FirmwareBuildError(str(error)) from error
        library_root = [] if library is None else [_root(library)]
        compiler = choose(wanted)
        own = [f"-D{macro}" for macro in (*defines, *([f"{side.upper()}_HAND"] if side else []))]
        options = [*compiler.options, *STANDARD, *(f"-D{macro}" for macro in DEFINES), *_checks(wanted)]
        roots = [HOST, *library_root]
        includes = [f"-I{root}" for root in (*roots, folder / "sketch", folder / "sketch/src")]
        jobs: list[_Job] = []
        for root in roots:
            kept = _kept(root, compiler, options)
            jobs += [_Job(unit, kept / f"{unit.name}.o", options) for unit in sorted(_units(root))]
        jobs += [_Job(unit, folder / f"{unit.name}.o", [*options, *own]) for unit in units]
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            for message in pool.map(lambda job: _compile(compiler, job, includes), jobs):
                if message is not None:
                    raise FirmwareBuildError(message)
        linking = [*compiler.options, *compiler.linking, "-pthread", *_checks(wanted)]
        link = [*compiler.command, *linking, *(str(job.target) for job in jobs), "-o", str(out)]
        done = subprocess.run(link, capture_output=True, text=True, check=False)
    if done.returncode:
        raise FirmwareBuildError(f"the firmware does not link:\n{done.stderr.strip()}")
    return compiler


def _checks(sanitize: frozenset[str]) -> list[str]:
    if not sanitize:
        return ["-O1", "-fno-sanitize=undefined"]
    named = ",".join(sorted(sanitize))
    return ["-O1", "-g", "-fno-omit-frame-pointer", f"-fsanitize={named}", "-fno-sanitize-recover=all"]


class _Job(NamedTuple):
    unit: Path
    target: Path
    options: list[str]


def _compile(compiler: Compiler, job: _Job, includes: list[str]) -> str | None:
    """Compile one unit unless cached; return the error message, or None on success."""
    unit, target, options = job
    if target.exists():
        return None
    # Written to a draft and renamed, so that an aborted build leaves no truncated object in the cache.
    draft = target.with_name(f"{target.name}.{os.getpid()}")
    command = [*compiler.command, *options, *includes, "-c", str(unit), "-o", str(draft)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        draft.unlink(missing_ok=True)
        hint = "\nThe servo library is given with --library." if "HLSCL.h" in done.stderr else ""
        return f"the firmware does not compile:\n{done.stderr.strip()}{hint}"
    draft.replace(target)
    return None


def _root(library: Path) -> Path:
    """Return the source folder of a library: `src` if present, as in Arduino libraries, else the folder itself."""
    root = library / "src" if (library / "src").is_dir() else library
    if not any(_units(root)):
        raise FirmwareBuildError(f"{library} holds no .cpp file; give the folder of FTServo_Arduino with --library")
    return root.resolve()


def _units(root: Path) -> list[Path]:
    return [HOST / "board.cpp"] if root == HOST else [path for path in root.glob("*") if path.suffix in UNITS]


def _home() -> Path:
    """Return the user's home, or a per-user temporary folder for users without one (containers, services)."""
    try:
        return Path.home()
    except RuntimeError:
        return Path(tempfile.gettempdir(), f"aero-hil-{os.getuid()}")


def _kept(root: Path, compiler: Compiler, options: list[str]) -> Path:
    """Return the cache folder for the objects of a root, named by a hash of compiler, options and sources."""
    digest = hashlib.sha256("\0".join([*compiler.command, *options]).encode())
    for folder in sorted({HOST, root}):
        for path in sorted(folder.rglob("*")):
            if path.suffix in UNITS + HEADERS:
                digest.update(path.name.encode() + path.read_bytes())
    cache = Path(os.environ.get("XDG_CACHE_HOME") or _home() / ".cache")
    kept = cache / "aero-hil" / "firmware" / digest.hexdigest()[:16]
    kept.mkdir(parents=True, exist_ok=True)
    return kept
