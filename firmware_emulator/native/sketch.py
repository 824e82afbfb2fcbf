"""Conversion of an Arduino sketch to C++ as by the Arduino tools: merged `.ino` files with function prototypes."""

import re
from collections.abc import Iterator
from pathlib import Path

UNITS = (".cpp", ".c", ".cc", ".cxx")
HEADERS = (".h", ".hpp", ".hh")

_NOT_CODE = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|^[ \t]*#(?:[^\n]*\\\n)*[^\n]*', re.S | re.M
)
_FUNCTION = re.compile(r"(?P<head>[A-Za-z_][\w\s:<>,*&\[\]]*?[\s*&](?P<name>[A-Za-z_]\w*)\s*\([^;{}()]*\))\s*\{")
_KEYWORDS = {"if", "for", "while", "switch", "catch", "else", "do", "return", "operator"}


class SketchError(Exception):
    """Folder without a sketch; the message names the expected files."""


def translated(source: Path, into: Path, *, side: str | None) -> list[Path]:
    """Convert a sketch folder to C++ in a new folder; return the units to compile.

    Every file starts with a `#line`, so that compilers and sanitizers report the user's file and line.

    Args:
        source: folder of the sketch, or its `.ino` file.
        into: output folder.
        side: `right` or `left` removes the choice in `HandConfig.h`; the compiler's command line then makes it.

    Raises:
        SketchError: the folder contains nothing to compile.
    """
    folder = source if source.is_dir() else source.parent
    if not folder.is_dir():
        raise SketchError(f"{source} does not exist; give the folder that holds the firmware's .ino file")
    sketches = sorted(folder.glob("*.ino"), key=lambda path: (path.stem != folder.name, path.name))
    into.mkdir(parents=True, exist_ok=True)
    units = []
    for path in sorted(_sources(folder)):
        text = path.read_text(encoding="utf-8-sig")
        if side is not None and path.name == "HandConfig.h":
            text = re.sub(r"^([ \t]*)#define[ \t]+(?:RIGHT|LEFT)_HAND\b[^\n]*", r"\1", text, flags=re.M)
        copy = into / path.relative_to(folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(f'#line 1 "{path.resolve()}"\n{text}', encoding="utf-8")
        if path.suffix in UNITS:
            units.append(copy)
    if sketches:
        copy = into / f"{sketches[0].stem}.ino.cpp"
        copy.write_text(_joined(sketches), encoding="utf-8")
        units.append(copy)
    if not units:
        raise SketchError(f"{folder} holds neither an .ino nor a .cpp file; give the folder that holds the firmware")
    return units


def prototypes(text: str) -> tuple[int, list[str]]:
    """Return the start of a sketch's first function (index into `text`) and the prototypes of all functions."""
    blank = _NOT_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    found = [
        (match.start("head"), " ".join(match["head"].split()) + ";")
        for match in _FUNCTION.finditer(blank)
        if _depth_is_zero(blank, match.start())
        and match["name"] not in _KEYWORDS
        and not re.search(r"[=]|\b(?:template|struct|class|enum|namespace|extern)\b", match["head"])
        and "::" not in match["head"].split("(")[0]
    ]
    return (found[0][0], [prototype for _, prototype in found]) if found else (len(text), [])


def _depth_is_zero(blank: str, at: int) -> bool:
    return blank.count("{", 0, at) == blank.count("}", 0, at)


def _sources(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.suffix in UNITS + HEADERS and path.is_file())


def _joined(sketches: list[Path]) -> str:
    parts = ["#include <Arduino.h>\n"]
    for path in sketches:
        text = path.read_text(encoding="utf-8-sig")
        at, declared = prototypes(text)
        line = text.count("\n", 0, at) + 1
        name = path.resolve()
        parts.append(f'#line 1 "{name}"\n{text[:at]}\n')
        parts += [f"{prototype}\n" for prototype in declared]
        parts.append(f'#line {line} "{name}"\n{text[at:]}\n')
    return "".join(parts)
