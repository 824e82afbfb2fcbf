"""`python -m train.shipped`: command, inputs and commit of each shipped file, checked against Git.

Comments, docstrings, `__future__` imports and formatting of Python and TOML inputs are ignored, so an edit of prose
leaves every artefact up to date. Other inputs are compared byte for byte.
"""

import ast
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import click
import tomli_w

from aero.exit_code import Exit
from aero.whole_file import write_whole
from aero_hil_toml import filled, parsed
from hil.cli.exits import run_module, usage_errors
from hil.dialogue.printing import echo

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_name("shipped.toml")
HEAD = (
    "# What ships, and what made it; train/shipped.py explains it, `python -m train.shipped` checks and updates it.\n\n"
)


class NoHistoryError(ValueError):
    """The folder is not a Git checkout with complete history, so provenance cannot be checked."""


@dataclass(frozen=True)
class Artefact:
    """Files made by one command."""

    files: tuple[str, ...]
    command: str
    commit: str
    inputs: tuple[str, ...] = ()
    """Files and folders that determine the command's output."""
    until: str = ""
    """Commit up to which `reason` explains the changes of the inputs; empty without explained changes."""
    reason: str = ""

    def __post_init__(self) -> None:
        if bool(self.until) != bool(self.reason):
            raise ValueError(f"{self.files[0]}: `until` and `reason` belong together")


def load(table: Path = TABLE) -> tuple[Artefact, ...]:
    """Return the artefacts of a table."""
    return filled(tuple[Artefact, ...], parsed(table.read_text(encoding="utf-8"), table.name)["artefact"], table.name)


def store(artefacts: tuple[Artefact, ...], table: Path = TABLE) -> None:
    """Write a table."""
    rows = [{name: value for name, value in asdict(one).items() if value} for one in artefacts]
    write_whole(table, HEAD + tomli_w.dumps({"artefact": rows}))


def made(artefacts: tuple[Artefact, ...], file: str, reason: str = "", root: Path = ROOT) -> tuple[Artefact, ...]:
    """Return the artefacts with `file` marked as made at the checked-out commit, or with its changed inputs explained.

    Args:
        artefacts: artefacts of the table.
        file: file of an artefact.
        reason: explanation of the inputs' changes up to the checked-out commit, added to earlier ones; empty if the
            file was regenerated.
        root: folder of the checkout.

    Raises:
        ValueError: no artefact has this file.
        NoHistoryError: `root` is not a checkout.
    """
    if not any(file in one.files for one in artefacts):
        listed = ", ".join(name for one in artefacts for name in one.files)
        raise ValueError(f"{file} is not listed; listed are {listed}")
    now = _git(root, "rev-parse", "--short=12", "HEAD").decode().strip()

    def changed(one: Artefact) -> Artefact:
        if not reason:
            return replace(one, commit=now, until="", reason="")
        known = reason in one.reason
        return replace(one, until=now, reason=one.reason if known else f"{one.reason}; {reason}".removeprefix("; "))

    return tuple(changed(one) if file in one.files else one for one in artefacts)


def problems(artefact: Artefact, root: Path = ROOT) -> Iterator[str]:
    """Yield one line for each problem of an artefact; none if the artefact is up to date.

    Raises:
        NoHistoryError: `root` is not a checkout with complete history.
    """
    missing = [name for name in (*artefact.files, *artefact.inputs) if not (root / name).exists()]
    yield from (f"{artefact.files[0]}: {name} does not exist" for name in missing)
    since = artefact.until or artefact.commit
    unknown = [commit for commit in {artefact.commit, since} if not exists(commit, root)]
    yield from (f"{artefact.files[0]}: commit {commit} is not in the history" for commit in unknown)
    if missing or unknown or not artefact.inputs:
        return
    listed = _git(root, "diff", "--name-only", "-z", since, "--", *artefact.inputs).decode()
    changed = [name for name in listed.split("\0") if name and _changed(name, since, root)]
    if changed:
        named = ", ".join(changed[:5]) + (f" and {len(changed) - 5} more" if len(changed) > 5 else "")
        yield f"{artefact.files[0]} is out of date: {named} changed since {since}; {artefact.command}"


def exists(commit: str, root: Path = ROOT) -> bool:
    """Return whether a commit is an ancestor of the checked-out one.

    Raises:
        NoHistoryError: `root` is not a checkout with complete history.
    """
    if _git(root, "rev-parse", "--is-shallow-repository").strip() != b"false":
        raise NoHistoryError("this checkout lacks its history; `git fetch --unshallow` brings it")
    command = ("git", "-C", str(root), "merge-base", "--is-ancestor", commit, "HEAD")
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def _changed(name: str, commit: str, root: Path) -> bool:
    path = root / name
    now = path.read_bytes() if path.is_file() else b""
    try:
        before = _git(root, "show", f"{commit}:{name}")
    except NoHistoryError:  # a new file
        return True
    return meaning(name, now) != meaning(name, before)


def meaning(name: str, content: bytes) -> object:
    """Return the comparable content of a file: Python without docstrings and future imports, TOML values, or bytes."""
    if name.endswith(".toml"):
        return tomllib.loads(content.decode())
    if not name.endswith(".py"):
        return content
    tree = ast.parse(content)
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, "body", None), list):
            node.body = [one for one in body if not (_is_docstring(one) or _is_future(one))]  # type: ignore[attr-defined]
    return ast.dump(tree)


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _is_future(node: ast.AST) -> bool:
    return isinstance(node, ast.ImportFrom) and node.module == "__future__"


def _git(root: Path, *arguments: str) -> bytes:
    try:
        done = subprocess.run(("git", "-C", str(root), *arguments), capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise NoHistoryError(f"{root} is not a checkout with its history: {error}") from error
    return done.stdout


@click.command()
@click.option("--check", is_flag=True, help="Print only outdated files; exit with 1 if there are any.")
@click.option("--made", "file", metavar="FILE", help="Mark FILE as made by the checked-out commit.")
@click.option("--reason", default="", help="With --made: reason why the changes since then are harmless.")
def shipped(*, check: bool, file: str | None, reason: str) -> None:
    """List the shipped files with the command and commit that made them, and the outdated ones.

    Requires a checkout with complete history.
    """
    with usage_errors():
        artefacts = load()
        if file is not None:
            artefacts = made(artefacts, file, reason)
            store(artefacts, TABLE)
        wrong = 0
        for artefact in artefacts:
            found = list(problems(artefact))
            wrong += bool(found)
            if found or not check:
                echo(f"{', '.join(artefact.files)}: {artefact.command}, commit {artefact.commit}")
            for line in found:
                echo(f"  {line}")
            if artefact.reason and not check:
                echo(f"  inputs changed until {artefact.until}: {artefact.reason}")
    sys.exit(Exit.OUT_OF_LIMITS if check and wrong else 0)


if __name__ == "__main__":
    run_module(shipped)
