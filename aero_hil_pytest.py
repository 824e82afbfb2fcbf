"""The pytest plugin of aero-hil: options, marks, and the fixtures `aero_target` and `aero_hand`.

It is there in every project whose environment has aero-hil, so it leaves alone whatever does not use its fixtures: an
option that the project has too is the project's, marks count only on tests with our fixtures, and no package of ours is
imported before a test needs it. Where another module has the name of a package of ours, one line says so.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from enum import StrEnum
from importlib import import_module
from typing import TYPE_CHECKING, Any

import pytest

from aero_hil import hidden

if TYPE_CHECKING:
    from aero.hand import Hand
    from hil.targets.hands_file import NamedHand
    from hil.targets.target import Target

IN_SOFTWARE = ("emulated", "pty")
"""Targets that need no hardware, and that any number of test processes may open at once."""
REST_WAIT_S, REST_TRIES = 0.2, 15
"""How often an opening hand is read, s, and how many times at most."""
REST_RAD_S = 0.2
"""Shaft speed below which a hand is at rest."""


def _seed(text: str) -> int:
    """Return what NumPy takes as a seed; the parser makes one line of the error."""
    if not 0 <= int(text) < 2**32:
        raise ValueError
    return int(text)


OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "hil": {
        "metavar": "TARGET",
        "default": "emulated",
        "help": "hand to test: emulated (default, virtual time), pty (real time), path or pyserial URL of a port, or a "
        "name in hands.toml",
    },
    "hil-firmware": {"metavar": "VERSION", "help": "firmware of the hand (default: of hands.toml, else 0.2.0)"},
    "hil-hand": {"choices": ("right", "left"), "help": "side (default: of hands.toml, else right)"},
    "hil-unit": {"metavar": "UNIT", "help": "emulated unit: shipped name or .toml (default reference)"},
    "hil-still": {"action": "store_true", "help": "skip tests that move the hand"},
    "hil-homing": {"action": "store_true", "help": "also run tests that home a hand in real time"},
    "hil-long": {"action": "store_true", "help": "also run tests that take long in real time"},
    "hil-seed": {"type": _seed, "default": 0, "help": "seed of the emulated hand's noise (default 0)"},
}
"""Each is `--NAME`, unless the project has that option itself, and always `--aero-NAME`."""

MARKERS = (
    "presence: a hand that fails this test is not tested further",
    "moves: moves the hand; skipped with --hil-still",
    "homes: drives the hand into its stops; on a hand in real time only with --hil-homing",
    "takes_long: takes more than a few seconds of hand time; in real time only with --hil-long",
    "needs_ground_truth: compares with what an emulated hand really does, hil.GroundTruth",
    "fault(text, ...): gets an emulated hand of its own with these faults, NAME[:CHANNEL][=SEVERITY][@SECONDS]",
)

_TARGET = pytest.StashKey["Target"]()
_TAKEN = pytest.StashKey[list[str]]()
"""Names of our options that the project has too."""
_NO_HAND = pytest.StashKey[str]()
"""Why the hand could not be opened, in a worker of pytest-xdist."""
_FAILED = pytest.StashKey[str]()
"""Name of the test that showed that no hand is there."""
_LEFT_OUT = "hil_left_out"
"""Property of a test that was skipped here, with a `Skip`."""


class Skip(StrEnum):
    """Why a test is skipped, in its JUnit properties; what is said then names the option that runs it."""

    NOT_PRESENT = "not_present"
    NOT_EMULATED = "not_emulated"
    MOVES = "moves"
    HOMES = "homes"
    TAKES_LONG = "takes_long"
    NO_GROUND_TRUTH = "no_ground_truth"


REASONS = {
    Skip.NOT_PRESENT: "this hand failed {failed}; mend that first, or choose another hand with --hil",
    Skip.NOT_EMULATED: "its faults are for an emulated hand; run with --hil=emulated, or see `aero-hil proxy`",
    Skip.MOVES: "moves the hand; run without --hil-still",
    Skip.HOMES: "drives the hand into its stops; run with --hil-homing",
    Skip.TAKES_LONG: "takes long in real time; run with --hil-long",
    Skip.NO_GROUND_TRUTH: "{target} has no ground truth; run with --hil=emulated",
}


@pytest.hookimpl(wrapper=True)
def pytest_load_initial_conftests(
    early_config: pytest.Config, parser: pytest.Parser
) -> Generator[None, object, object]:
    """Add the options after those of the project's conftest files, whose names count."""
    result = yield
    theirs = {name for group in (*parser._groups, parser._anonymous) for one in group.options for name in one.names()}
    early_config.stash[_TAKEN] = []
    group = parser.getgroup("aero-hil", "Aero Hand Open")
    for name, settings in OPTIONS.items():
        short, full = f"--{name}", f"--aero-{name}"
        if short in theirs:
            early_config.stash[_TAKEN].append(short)
        group.addoption(full, *({short} - theirs), dest=full.lstrip("-").replace("-", "_"), **settings)
    return result


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers, and refuse options that cannot work before any test process starts."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    option = config.option
    name = option.aero_hil
    if name not in IN_SOFTWARE and not hasattr(config, "workerinput") and _workers(config) > 1:
        raise pytest.UsageError(f"--hil={name}: one program at a time can use a hand; run without -n, or with -n 1")
    if name not in IN_SOFTWARE:
        _named_hand(config)
    if option.aero_hil_firmware is not None or option.aero_hil_unit is not None:
        _opener(config)


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Say in one line what of aero-hil this project has hidden."""
    if line := hidden():
        return [f"aero-hil stands aside: {line}"]
    if taken := config.stash.get(_TAKEN, None):
        ours = ", ".join(f"--aero-{name.lstrip('-')}" for name in taken)
        return [f"aero-hil: {', '.join(taken)} is this project's own; aero-hil's is {ours}"]
    return []


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give a test with faults its own hand: `aero_target`, else one for the session, is then one for the test."""
    texts = _fault_texts(metafunc.definition)
    if texts and _uses(metafunc.definition, "aero_target"):
        # Older than pytest 8.4 shows an ID.
        ids = [getattr(pytest, "HIDDEN_PARAM", "faults")]
        metafunc.parametrize("aero_target", [texts], indirect=True, scope="function", ids=ids)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put presence tests first and those that home last, whose zero stays; other projects' tests keep their places."""
    places = [place for place, item in enumerate(items) if _uses(item, "aero_target")]
    ours = [items[place] for place in places]
    for item in ours:
        if texts := _fault_texts(item):
            try:
                _faults(texts)
            except ValueError as error:
                raise pytest.UsageError(f"{item.nodeid}: {error}") from error
    ours.sort(
        key=lambda item: (item.get_closest_marker("presence") is None, item.get_closest_marker("homes") is not None)
    )
    for place, item in zip(places, ours, strict=True):
        items[place] = item


def pytest_report_collectionfinish(config: pytest.Config, items: list[pytest.Item]) -> str | list[str]:
    """Say which hand will be tested, in a session that tests one."""
    if not any(_uses(item, "aero_target") for item in items):
        return []
    option = config.option
    named = _named_hand(config)
    firmware = option.aero_hil_firmware or named.firmware or _ours("aero.firmware").DEFAULT_FIRMWARE
    side = option.aero_hil_hand or named.side or "right"
    emulated = f", unit {option.aero_hil_unit or 'reference'}, seed {option.aero_hil_seed}"
    return (
        f"aero-hil: {side} hand on {option.aero_hil}, firmware {firmware}"
        f"{emulated if option.aero_hil in IN_SOFTWARE else ''}"
    )


def pytest_collection_finish(session: pytest.Session) -> None:
    """Open the hand before the first test, so that a missing one is one error and not one for every test."""
    config = session.config
    if config.option.collectonly or not any(_uses(item, "aero_target") for item in session.items):
        return
    try:
        _open(config)
    except pytest.UsageError as error:
        if not hasattr(config, "workerinput"):
            raise
        # pytest-xdist takes a worker that ends for a crash; the first test says it there.
        config.stash[_NO_HAND] = str(error)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what this hand cannot or must not do, with the reason, and record which hand it is."""
    if not _uses(item, "aero_target"):
        return
    stash, name = item.config.stash, item.config.option.aero_hil
    if _NO_HAND in stash and _FAILED not in stash:
        stash[_FAILED] = item.name
        pytest.fail(stash[_NO_HAND], pytrace=False)
    if skip := _skip(item):
        item.user_properties.append((_LEFT_OUT, str(skip.value)))
        pytest.skip(REASONS[skip].format(failed=stash.get(_FAILED, ""), target=name))
    target = stash[_TARGET]
    for name, value in _properties(target).items():
        item.user_properties.append((f"hil_{name}", value))
    if texts := _fault_texts(item):
        item.user_properties.append(("hil_faults", " ".join(map(str, _faults(texts)))))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Remember a presence test that failed."""
    report = yield
    if report.failed and item.get_closest_marker("presence") and _uses(item, "aero_target"):
        item.config.stash[_FAILED] = item.name
    return report


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say what of the suite was left out, why, and which flag runs it."""
    left_out: dict[str, list[str]] = {}
    for report in terminalreporter.stats.get("skipped", []):
        # A module that is skipped while it is collected has a report without properties.
        if any(name == _LEFT_OUT for name, _ in getattr(report, "user_properties", ())):
            reason = report.longrepr[2].removeprefix("Skipped: ")
            left_out.setdefault(reason, []).append(report.nodeid.rpartition("::")[2])
    if not left_out:
        return
    terminalreporter.section("aero-hil: left out")
    for reason, names in left_out.items():
        terminalreporter.line(f"{len(names)}: {reason}")
        terminalreporter.line(f"    {', '.join(names)}")


@pytest.fixture(scope="session")
def aero_target(request: pytest.FixtureRequest) -> Iterator[Target]:
    """The hand chosen by `--hil`, see `hil.Target`: one for the session, and one of its own for a test with faults."""
    texts = getattr(request, "param", ())
    if not texts:
        # A test that asks for it while it runs was not seen before.
        yield request.config.stash.get(_TARGET, None) or _open(request.config)
        return
    with _opener(request.config, texts) as target:
        yield target


@pytest.fixture
def aero_hand(aero_target: Target) -> Hand:
    """The driver of the target's hand, commanded open and at rest."""
    hand, clock = aero_target.hand, aero_target.clock
    hand.command_codes([0] * 7)
    for _ in range(REST_TRIES):
        clock.sleep_until(clock.now() + REST_WAIT_S)
        if all(abs(hand.read_speeds()) < REST_RAD_S):
            return hand
    pytest.fail(f"the hand does not come to rest within {REST_TRIES * REST_WAIT_S:g} s of opening")


def _ours(name: str) -> Any:
    """Import a module of ours.

    Raises:
        UsageError: another module has its name, or what it needs is not installed.
    """
    if line := hidden():
        raise pytest.UsageError(line)
    try:
        return import_module(name)
    except ImportError as error:
        raise pytest.UsageError(f"aero-hil: {error}; `aero-hil doctor` says how to install `suite`") from error


def _one_line(error: Exception) -> str:
    """Return what the command line says of an error; one of ours, whose traceback is worth more, is raised again."""
    if isinstance(error, (pytest.UsageError, ValueError)):
        return str(error)
    exits = _ours("hil.cli.exits")
    code, line = exits.ending(error)
    if code == exits.Exit.DEFECT:
        raise error
    return str(line)


def _workers(config: pytest.Config) -> int:
    """Return how many processes pytest-xdist starts: `-n` as it resolved it, or `--tx 3*popen`."""
    counts = (spec.partition("*")[0] for spec in getattr(config.option, "tx", None) or () if spec)
    return sum(int(count) if count.isdigit() else 1 for count in counts)


def _uses(item: pytest.Item, fixture: str) -> bool:
    """Return whether a test uses a fixture of this file, and not only another one of its name."""
    info = getattr(item, "_fixtureinfo", None)
    for definition in reversed(info.name2fixturedefs.get(fixture, ()) if info is not None else ()):
        if definition.func.__module__ == __name__:
            return True
        if fixture not in definition.argnames:
            return False
    return False


def _skip(item: pytest.Item) -> Skip | None:
    """Return why a test is skipped, or None."""
    option, stash = item.config.option, item.config.stash
    marks = {mark.name for mark in item.iter_markers()}
    emulated = option.aero_hil in IN_SOFTWARE
    target = stash.get(_TARGET, None)
    real_time = target is None or target.real_time
    truth = target is None or target.find(_ours("hil.targets.target").GroundTruth) is not None
    reasons = {
        Skip.NOT_EMULATED: "fault" in marks and not emulated,
        Skip.NOT_PRESENT: _FAILED in stash,
        Skip.MOVES: "moves" in marks and option.aero_hil_still,
        Skip.HOMES: "homes" in marks and real_time and not option.aero_hil_homing,
        Skip.TAKES_LONG: "takes_long" in marks and real_time and not option.aero_hil_long,
        Skip.NO_GROUND_TRUTH: "needs_ground_truth" in marks and not truth,
    }
    return next((skip for skip, applies in reasons.items() if applies), None)


def _fault_texts(item: pytest.Item) -> tuple[str, ...]:
    return tuple(str(text) for mark in item.iter_markers("fault") for text in mark.args)


def _faults(texts: Sequence[str]) -> tuple[object, ...]:
    """Return the faults of a test's marks; raises ValueError for what is none."""
    return tuple(map(_ours("hil.faults.catalogue").parse_fault, texts))


def _properties(target: Target) -> dict[str, str]:
    """Return what a JUnit report should say about the hand under test."""
    return {
        "target": target.name,
        "hand": target.side,
        "firmware": target.firmware,
        "map": target.map.coefficients.name,
        "window": target.map.window.name,
        "unit": target.unit,
        "seed": str(target.seed),
        "commit": _ours("hil.recordings.provenance").source_commit(),
    }


def _open(config: pytest.Config) -> Target:
    """Open the hand of the session.

    Raises:
        UsageError: it cannot be opened.
    """
    opened = ExitStack()
    try:
        target = opened.enter_context(_opener(config))
    except Exception as error:
        raise pytest.UsageError(_one_line(error)) from error
    config.add_cleanup(opened.close)
    config.stash[_TARGET] = target
    return target


def _named_hand(config: pytest.Config) -> NamedHand:
    """Return what `--hil` names.

    Raises:
        UsageError: nothing, or `hands.toml` has a mistake.
    """
    try:
        named: NamedHand = _ours("hil.targets.hands_file").named_hand(config.option.aero_hil)
    except ValueError as error:
        raise pytest.UsageError(f"--hil: {error}") from error
    return named


def _opener(config: pytest.Config, texts: Sequence[str] = ()) -> AbstractContextManager[Target]:
    """Return the target's context manager, not yet entered."""
    option = config.option
    opening = _ours("hil.targets.opening")
    try:
        target: AbstractContextManager[Target] = opening.open_target(
            option.aero_hil,
            firmware=option.aero_hil_firmware,
            hand=option.aero_hil_hand,
            unit=option.aero_hil_unit or "reference",
            seed=option.aero_hil_seed,
            faults=_faults(texts),
            # As an owner's hand has been; one with faults might not come through it.
            homed=not texts and not option.aero_hil_still,
        )
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error
    return target
