"""Embedded store of a campaign: one DuckDB file that other tools can query.

`trials` has a row for each run, `numbers` one for each number that it measured. An outcome is written in one
transaction, so a program that is killed leaves whole outcomes and nothing else.
"""

import dataclasses
import json
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import duckdb

from aero.exit_code import Exit
from train.campaign.trial import Outcome, Trial

NAME = "campaign.duckdb"
_TABLES = """
CREATE TABLE IF NOT EXISTS trials (
    key VARCHAR PRIMARY KEY, trial JSON, failed VARCHAR[], stopped VARCHAR, ended VARCHAR,
    wall_s DOUBLE, hand_s DOUBLE, commit VARCHAR, suspects VARCHAR
);
CREATE TABLE IF NOT EXISTS numbers (
    key VARCHAR, experiment VARCHAR, subject VARCHAR, metric VARCHAR, value DOUBLE
);
"""
_PLAIN = ("failed", "stopped", "ended", "wall_s", "hand_s", "commit")
"""Fields of an outcome that are stored unchanged as columns."""
_COLUMNS = ", ".join(("key", "trial", "suspects", *_PLAIN))


class StoreError(ValueError):
    """Campaign missing, locked by another program, or damaged; the message gives the cause."""

    exit_code = Exit.USAGE


class Store:
    """Outcomes on disk, for one writing program at a time.

    Raises:
        StoreError: on reading, the file is damaged.
        OSError: on writing, the disk is full or gone.
    """

    def __init__(self, connection: duckdb.DuckDBPyConnection, path: Path) -> None:
        self._connection = connection
        self._path = path
        with _read(path):
            self._keys = {key for (key,) in connection.execute("SELECT key FROM trials").fetchall()}

    def add(self, outcome: Outcome) -> None:
        """Store an outcome; one that is already stored stays unchanged."""
        if outcome.trial.key in self._keys:
            return
        key = outcome.trial.key
        numbers = [
            (experiment, subject, metric, float(value))
            for experiment, subjects in outcome.numbers.items()
            for subject, metrics in subjects.items()
            for metric, value in metrics.items()
        ]
        table = dataclasses.asdict(outcome)
        row = [key, json.dumps(table["trial"]), " ".join(outcome.suspects), *(table[name] for name in _PLAIN)]
        try:
            self._connection.begin()
            self._connection.execute(f"INSERT INTO trials ({_COLUMNS}) VALUES ({', '.join('?' * len(row))})", row)
            if numbers:
                # One statement with four columns as lists: a row at a time takes sixty milliseconds an outcome.
                columns = [list(column) for column in zip(*numbers, strict=True)]
                self._connection.execute(
                    "INSERT INTO numbers SELECT ?, unnest(?), unnest(?), unnest(?), unnest(?)", [key, *columns]
                )
            self._connection.commit()
        except duckdb.Error as error:
            raise OSError(f"cannot write to the campaign {self._path}: {_line(error)}") from error
        self._keys.add(key)

    def require_commit(self, commit: str) -> None:
        """Check that all outcomes have this commit, because other commits measure other numbers.

        Raises:
            StoreError: some are of another.
        """
        rows = self._connection.execute("SELECT DISTINCT commit FROM trials").fetchall()
        if others := sorted({found for (found,) in rows} - {commit}):
            raise StoreError(
                f"{self._path} has runs of commit {', '.join(map(repr, others))}, this program is of {commit!r}; "
                "give another folder with --out, or check that commit out"
            )

    def keys(self) -> frozenset[str]:
        """Return the keys of all finished trials."""
        return frozenset(self._keys)

    def outcomes(self) -> Iterator[Outcome]:
        """Return all outcomes in the order of storage."""
        with _read(self._path):
            yield from self._outcomes()

    def _outcomes(self) -> Iterator[Outcome]:
        numbers: dict[str, dict[str, dict[str, dict[str, float]]]] = {}
        for key, experiment, subject, metric, value in self._connection.execute("SELECT * FROM numbers").fetchall():
            numbers.setdefault(key, {}).setdefault(experiment, {}).setdefault(subject, {})[metric] = value
        rows = self._connection.execute(f"SELECT {_COLUMNS} FROM trials ORDER BY rowid").fetchall()
        for key, trial, suspects, failed, *plain in rows:
            yield Outcome(
                trial=Trial.of(json.loads(trial)),
                numbers=numbers.get(key, {}),
                suspects=tuple(suspects.split()),
                failed=tuple(failed),
                **dict(zip(_PLAIN[1:], plain, strict=True)),
            )


INTERRUPTED = "Query interrupted"


@contextmanager
def opened(folder: Path, *, read_only: bool = False) -> Iterator[Store]:
    """Open the store in a folder, which is created if missing.

    Raises:
        StoreError: no store to read, a store that another program writes to, or a damaged file.
    """
    path = folder / NAME
    if read_only and not path.is_file():
        raise StoreError(f"there is no campaign in {folder}; `aero-hil campaign --out {folder}` makes one")
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        raise StoreError(f"{path}: the name of the folder is not UTF-8, which DuckDB needs") from error
    if path.exists() and not path.is_file():
        raise StoreError(f"{path} is not a regular file")
    folder.mkdir(parents=True, exist_ok=True)
    try:
        connection = duckdb.connect(str(path), read_only=read_only)
    except duckdb.Error as error:
        raise StoreError(f"cannot open the campaign {path}: {_line(error)}") from error
    with closing(connection), _interruptible():
        with _read(path):
            if not read_only:
                connection.execute(_TABLES)
            store = Store(connection, path)
        yield store


@contextmanager
def _interruptible() -> Iterator[None]:
    """Convert DuckDB's error after Ctrl-C in a query to KeyboardInterrupt."""
    try:
        yield
    except RuntimeError as error:
        if INTERRUPTED not in str(error):
            raise
        raise KeyboardInterrupt from error


@contextmanager
def _read(path: Path) -> Iterator[None]:
    """Convert errors of DuckDB and of stored content to a StoreError that names the file."""
    try:
        yield
    except (duckdb.Error, LookupError, TypeError, AttributeError, ValueError, RecursionError, MemoryError) as error:
        raise StoreError(f"the campaign {path} is damaged: {_line(error)}") from error


def _line(error: BaseException) -> str:
    """Return the first line of a DuckDB error, which can include a trace."""
    return str(error).partition("\n")[0]


def missing(trials: Iterable[Trial], done: frozenset[str]) -> list[Trial]:
    """Return the unfinished trials in order, without duplicates."""
    return list({trial.key: trial for trial in trials if trial.key not in done}.values())
