"""Inputs of a made file or table: what its maker imports and opens, each file with a digest of its meaning.

Comments, docstrings and formatting have no meaning. Imports are read from the sources, so that an import inside a
function counts too; modules found by a scan of a folder, and data files, are noted while a sample is made.
"""

from __future__ import annotations

import ast
import json
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
FOLDERS = (ROOT, ROOT / "docs", ROOT / "tests" / "support", ROOT / "examples")
"""Folders of importable modules."""
NOT_READ = {".git", ".tox", ".venv", "build", "__pycache__"}
"""Folders of the checkout without sources."""

Inputs = Mapping[str, str]
"""Digest by path relative to the checkout."""


@cache
def digest(path: Path) -> str:
    """Return the digest of a file's meaning, 8 hexadecimal digits, equal for all versions of Python."""
    content = path.read_bytes()
    if path.suffix == ".py":
        content = repr(_shape(ast.parse(content))).encode()
    elif path.suffix == ".toml":
        content = json.dumps(tomllib.loads(content.decode()), sort_keys=True, default=str).encode()
    return sha256(content.replace(b"\r\n", b"\n")).hexdigest()[:8]


def _shape(node: Any) -> Any:
    """Return a syntax tree as tuples, without docstrings, positions and empty fields."""
    if isinstance(node, list):
        return [_shape(one) for one in node if not _is_docstring(one)]
    if not isinstance(node, ast.AST):
        return node
    fields = {name: getattr(node, name, None) for name in node._fields if name != "kind"}
    if isinstance(node, ast.JoinedStr):  # Python 3.12.1 alone has empty pieces
        fields["values"] = [one for one in node.values if not (isinstance(one, ast.Constant) and one.value == "")]
    return type(node).__name__, [(name, _shape(value)) for name, value in fields.items() if value not in (None, [])]


def _is_docstring(node: Any) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def closure(modules: Iterable[str]) -> set[Path]:
    """Return the files of modules and of all that they import, directly or not, within the checkout."""
    found: set[Path] = set()
    left = list(modules)
    while left:
        name = left.pop()
        path = _file(name)
        left += [name.rpartition(".")[0]] if "." in name else []
        if path is not None and path not in found:
            found.add(path)
            left += _imported(path)
    return found


@cache
def _file(module: str) -> Path | None:
    for folder in FOLDERS:
        place = folder.joinpath(*module.split("."))
        for path in (place.with_suffix(".py"), place / "__init__.py"):
            if path.exists():
                return path
    return None


@cache
def _imported(path: Path) -> list[str]:
    """Return the modules that a source names in its imports."""
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names += [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [node.module, *(f"{node.module}.{one.name}" for one in node.names)]
    return names


def traced(make: Callable[[], Any]) -> tuple[Any, set[Path]]:
    """Make something; return it with the files of the checkout that were imported or read.

    To be called once in a process and before anything that counts is imported, because both are read only once.
    """
    opened: set[str] = set()

    def note(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str) and not set("wax+") & set(arguments[1] or ""):
            opened.add(arguments[0])

    sys.addaudithook(note)
    made = make()
    loaded = [getattr(module, "__file__", None) or "" for module in [*sys.modules.values()]]
    return made, set(_sources(map(Path, {*loaded, *opened})))


def _sources(paths: Iterable[Path]) -> Iterator[Path]:
    """Yield the files of the checkout that are sources or data."""
    for path in paths:
        if path.is_relative_to(ROOT) and path.is_file() and not NOT_READ & set(path.relative_to(ROOT).parts):
            yield path


def digests(paths: Iterable[Path]) -> dict[str, str]:
    """Return the digest of each file by its path in the checkout, in order."""
    return {path.relative_to(ROOT).as_posix(): digest(path) for path in sorted(paths)}


def changed(inputs: Inputs, root: Path = ROOT) -> list[str]:
    """Return the inputs whose meaning differs from the noted one."""
    return [name for name, noted in inputs.items() if not (root / name).is_file() or digest(root / name) != noted]
