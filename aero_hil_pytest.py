"""The pytest plugin of aero-hil: options, marks, and the fixtures `aero_target` and `aero_hand`.

It is there in every project whose environment has aero-hil, so it leaves alone whatever does not use its fixtures: an
option that the project has too is the project's, marks count only on tests with our fixtures, and no package of ours is
imported before a test needs it. Where another module has the name of a package of ours, one line says so.
"""

from __future__ import annotations

import sys
import threading
import time
from argparse import SUPPRESS
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import pytest
from _pytest.scope import Scope

from aero_hil import PACKAGES, hidden

if TYPE_CHECKING:
    from aero.hand import Hand
    from hil.targets.hand_spec import HandSpec
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


GROUP = "aero-hil"
"""Our options in the help of pytest."""
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
_FAULTS = pytest.StashKey[tuple[str, ...]]()
"""Texts of the faults that a test's hand is opened with."""
_OWN = pytest.StashKey[list[tuple[str, Any]]]()
"""Properties of the hand with faults that was opened last, until its test's report has them."""
_SLEPT = pytest.StashKey[list[float]]()
"""What a test and its fixtures slept, s, while the time of its hand stood."""
_NO_HAND = pytest.StashKey[str]()
"""Why the hand could not be opened, in a worker of pytest-xdist."""
_FAILED = pytest.StashKey[str]()
"""Name of the test that showed that no hand is there."""


NOT_EMULATED = "its faults are for an emulated hand; run with --hil=emulated, or see `aero-hil proxy`"
SLEPT = (
    "this test slept {seconds:g} s of real time, in which the emulated hand's time stood still: it moved nothing; use "
    "`aero_target.clock.sleep_until(aero_target.clock.now() + SECONDS)`, which waits on any hand"
)


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    """Add the options, the short names only where the project's conftest files are known."""
    group = parser.getgroup(GROUP, "Aero Hand Open")
    for name, settings in OPTIONS.items():
        group.addoption(f"--aero-{name}", dest=_dest(name), **{**settings, "help": SUPPRESS})
    # Named in a conftest's `pytest_plugins`, this file comes after the conftest's own options and after the hook below.
    if any(
        Path(getattr(plugin, "__file__", None) or "").name == "conftest.py" for plugin in pluginmanager.get_plugins()
    ):
        _add_short_names(parser)


@pytest.hookimpl(wrapper=True)
def pytest_load_initial_conftests(parser: pytest.Parser) -> Generator[None, object, object]:
    """Add the short names after the options of the project's conftest files, whose names count."""
    result = yield
    _add_short_names(parser)
    return result


def _add_short_names(parser: pytest.Parser) -> None:
    """Add each short name that the project has not."""
    group = parser.getgroup(GROUP)
    theirs = _theirs(parser)
    for name, settings in OPTIONS.items():
        if f"--{name}" not in theirs:
            group.addoption(f"--{name}", dest=_dest(name), **settings)


def _theirs(parser: pytest.Parser) -> set[str]:
    """Return the names of the options that are not ours."""
    groups = [group for group in (*parser._groups, parser._anonymous) if group.name != GROUP]
    return {name for group in groups for option in group.options for name in option.names()}


def _dest(name: str) -> str:
    return f"aero_{name.replace('-', '_')}"


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers, and refuse options that cannot work before any test process starts."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    option = config.option
    name = option.aero_hil
    if name not in IN_SOFTWARE and not hasattr(config, "workerinput") and _workers(config) > 1:
        raise pytest.UsageError(f"--hil={name}: one program at a time can use a hand; run without -n, or with -n 1")
    if name not in IN_SOFTWARE or option.aero_hil_firmware is not None or option.aero_hil_unit is not None:
        _opener(config)


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Say in one line what of aero-hil this project has hidden."""
    if line := hidden():
        return [f"aero-hil stands aside: {line}"]
    theirs = _theirs(config._parser)
    if taken := [f"--{name}" for name in OPTIONS if f"--{name}" in theirs]:
        ours = ", ".join(f"--aero-{name.lstrip('-')}" for name in taken)
        return [f"aero-hil: {', '.join(taken)} is this project's own; aero-hil's is {ours}"]
    return []


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Generator[None, object, object]:
    """Put presence tests first and those that home last, whose zero stays; other projects' tests keep their places.

    A test with faults gets its own hand. This comes after every other hook, so that a mark counts from wherever pytest
    takes marks: of functions, classes, modules, parameters, and of collection hooks.
    """
    result = yield
    for item in items:
        _give_faults(item)
    places = [place for place, item in enumerate(items) if _uses(item, "aero_target")]
    ours = [items[place] for place in places]
    ours.sort(
        key=lambda item: (item.get_closest_marker("presence") is None, item.get_closest_marker("homes") is not None)
    )
    for place, item in zip(places, ours, strict=True):
        items[place] = item
    return result


@dataclass(frozen=True)
class _Parameters:
    """What pytest reads of the parameters of a test, `item.callspec`; its own class is private."""

    params: Mapping[str, object] = field(default_factory=dict)
    indices: Mapping[str, int] = field(default_factory=dict)
    _arg2scope: Mapping[str, object] = field(default_factory=dict)
    id: str = ""


def _give_faults(item: pytest.Item) -> None:
    """Make the faults of a test's marks the parameter of its `aero_target`, which is then one for this test.

    Raises:
        UsageError: a test that uses our fixture is marked with what is no fault.
    """
    texts = _fault_texts(item)
    if not texts or not isinstance(item, pytest.Function):
        return
    if _uses(item, "aero_target"):
        try:
            _faults(texts)
        except ValueError as error:
            raise pytest.UsageError(f"{item.nodeid}: {error}") from error
    elif "aero_target" in item.fixturenames:
        return  # the project's own
    item.stash[_FAULTS] = texts
    given: Any = getattr(item, "callspec", None) or _Parameters()
    added: Mapping[str, Mapping[str, object]] = {
        "params": {"aero_target": texts}, "indices": {"aero_target": 0}, "_arg2scope": {"aero_target": Scope.Function},
    }  # fmt: skip
    replaced: Any = replace(given, **{name: {**getattr(given, name), **more} for name, more in added.items()})
    item.callspec = replaced


def pytest_report_collectionfinish(config: pytest.Config, items: list[pytest.Item]) -> str | list[str]:
    """Say which hand will be tested, in a session that tests one."""
    if not any(_uses(item, "aero_target") for item in items):
        return []
    return f"aero-hil: {_spec(config).describe()}"


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


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, object, object]:
    """Prepare a test; what its fixtures sleep counts as its own."""
    _prepare(item)
    with _real_sleeps(item):
        return (yield)


def _prepare(item: pytest.Item) -> None:
    """Skip what this hand cannot or must not do, with the reason, and record which hand it is."""
    if not _uses(item, "aero_target"):
        return
    stash = item.config.stash
    if _NO_HAND in stash and _FAILED not in stash:
        stash[_FAILED] = item.name
        pytest.fail(stash[_NO_HAND], pytrace=False)
    if reason := _left_out(item):
        pytest.skip(reason)
    if _FAULTS not in item.stash:
        item.user_properties += _properties(stash[_TARGET])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Fail a test that marks a fault when its hand is there already, or that sleeps while the hand's time stands."""
    try:
        with _real_sleeps(item):
            result = yield
    except BaseException as error:
        if words := _why_it_shows_nothing(item):
            error.add_note(words)
        raise
    if words := _why_it_shows_nothing(item):
        pytest.fail(words, pytrace=False)
    return result


def _why_it_shows_nothing(item: pytest.Item) -> str:
    """Return why the ending of a test says nothing about its hand; empty where it does."""
    if not _asked_for(item):
        return ""
    if late := [text for text in _fault_texts(item) if text not in item.stash.get(_FAULTS, ())]:
        return f"the mark fault({', '.join(late)}) came when the hand was open already: the hand has none of it"
    if slept := sum(item.stash.get(_SLEPT, ())):
        return SLEPT.format(seconds=slept)
    return ""


@contextmanager
def _real_sleeps(item: pytest.Item) -> Iterator[None]:
    """Note how long the project's code sleeps, s, while a test has a hand on virtual time, whose time stands then."""
    if item.config.option.aero_hil != "emulated" or not isinstance(item, pytest.Function):
        yield
        return
    sleep, tester = time.sleep, threading.current_thread()
    slept = item.stash.setdefault(_SLEPT, [])

    def noted(seconds: float) -> None:
        sleep(seconds)
        # A thread of the project, a library, or our own code in real time may wait for what it likes.
        if threading.current_thread() is tester and _of_the_project(sys._getframe(1), item.config.rootpath):
            slept.append(seconds)

    functions = [one.func for of_name in item._fixtureinfo.name2fixturedefs.values() for one in of_name]
    # `from time import sleep` gives it a second name, in the files of the test and of its fixtures.
    scopes = {id(scope): scope for scope in (vars(item.module), *(getattr(f, "__globals__", {}) for f in functions))}
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(time, "sleep", noted)
        for scope in scopes.values():
            for name in [name for name, value in scope.items() if value is sleep]:
                patched.setitem(scope, name, noted)
        yield


def _of_the_project(frame: FrameType, root: Path) -> bool:
    """Return whether a line of the project under test is running, and none of a library or of ours."""
    path = Path(frame.f_code.co_filename)
    package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
    return path.is_relative_to(root) and "site-packages" not in path.parts and package not in PACKAGES


def _asked_for(item: pytest.Item) -> bool:
    """Return whether a test has got our hand, by its arguments or while it ran."""
    if _uses(item, "aero_target"):
        return True
    # A fixture that was asked for while the test ran is in no list of its arguments.
    active = getattr(getattr(item, "_request", None), "_fixture_defs", {})
    return "aero_target" in active and active["aero_target"].func.__module__ == __name__


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Record the hand of its own that a test with faults has got, and remember a presence test that failed."""
    # Not by the fixture: its `request` is the session's in some versions of pytest.
    if _OWN in item.config.stash:
        properties = item.config.stash[_OWN]
        item.user_properties += properties
        del item.config.stash[_OWN]
    if call.when == "call" and isinstance(item, pytest.Function) and _uses(item, "aero_target"):
        item.user_properties += _acts(item.funcargs["aero_target"])
    report = yield
    if report.failed and item.get_closest_marker("presence") and _uses(item, "aero_target"):
        item.config.stash[_FAILED] = item.name
    return report


@pytest.fixture(scope="session")
def aero_target(request: pytest.FixtureRequest) -> Iterator[Target]:
    """The hand chosen by `--hil`, see `hil.Target`: one for the session, and one of its own for a test with faults."""
    texts = getattr(request, "param", ())
    if not texts:
        # A test that asks for it while it runs was not seen before.
        yield request.config.stash.get(_TARGET, None) or _open(request.config)
        return
    if request.config.option.aero_hil not in IN_SOFTWARE:
        pytest.skip(NOT_EMULATED)
    try:
        opening = _opener(request.config, texts)
    except ValueError as error:
        pytest.fail(f"aero_target: {error}", pytrace=False)
    with opening as target:
        request.config.stash[_OWN] = _properties(target)
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


def _left_out(item: pytest.Item) -> str:
    """Return why a test is skipped and which option runs it; empty where it is not."""
    option, stash = item.config.option, item.config.stash
    marks = {mark.name for mark in item.iter_markers()}
    target = stash.get(_TARGET, None)
    real_time = target is None or target.real_time
    truth = target is None or target.find(_ours("hil.targets.target").GroundTruth) is not None
    failed = stash.get(_FAILED, "")
    reasons = {
        NOT_EMULATED: "fault" in marks and option.aero_hil not in IN_SOFTWARE,
        f"this hand failed {failed}; mend that first, or choose another hand with --hil": failed,
        "moves the hand; run without --hil-still": "moves" in marks and option.aero_hil_still,
        "drives the hand into its stops; run with --hil-homing": (
            "homes" in marks and real_time and not option.aero_hil_homing
        ),
        "takes long in real time; run with --hil-long": (
            "takes_long" in marks and real_time and not option.aero_hil_long
        ),
        f"{option.aero_hil} has no ground truth; run with --hil=emulated": "needs_ground_truth" in marks and not truth,
    }
    return next((reason for reason, applies in reasons.items() if applies), "")


def _fault_texts(item: pytest.Item) -> tuple[str, ...]:
    return tuple(str(text) for mark in item.iter_markers("fault") for text in mark.args)


def _faults(texts: Sequence[str]) -> tuple[object, ...]:
    """Return the faults of a test's marks; raises ValueError for what is none."""
    return tuple(map(_ours("hil.faults.catalogue").parse_fault, texts))


def _properties(target: Target) -> list[tuple[str, Any]]:
    """Return what a JUnit report should say about the hand that a test has."""
    known = {
        "target": target.name,
        "hand": target.side,
        "firmware": target.firmware,
        "map": target.map.coefficients.name,
        "window": target.map.window.name,
        "unit": target.unit,
        "seed": str(target.seed),
        "commit": _ours("hil.recordings.provenance").source_commit(),
    }
    if target.wrong:
        known["faults"] = " ".join(map(str, target.wrong))
    return [(f"hil_{name}", value) for name, value in known.items()]


def _acts(target: Any) -> list[tuple[str, str]]:
    """Return what a test did to its emulated hand, and make the hand again what it was for the next test."""
    bench = target.find(_ours("hil.faults.workbench").Workbench)
    done = [] if bench is None else bench.mend()
    return [("hil_acts", "; ".join(f"{t:.2f} s: {text}" for t, text in done))] if done else []


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


def _spec(config: pytest.Config, texts: Sequence[str] = ()) -> HandSpec:
    """Return the hand that the options choose.

    Raises:
        UsageError: there is none such.
    """
    option = config.option
    try:
        spec: HandSpec = _ours("hil.targets.hand_spec").HandSpec.named(
            option.aero_hil,
            firmware=option.aero_hil_firmware,
            hand=option.aero_hil_hand,
            unit=option.aero_hil_unit,
            seed=option.aero_hil_seed,
            faults=_faults(texts),
            # As an owner's hand has been; one with faults might not come through it.
            homed=not texts and not option.aero_hil_still,
        )
    except ValueError as error:
        raise pytest.UsageError(f"--hil: {error}") from error
    return spec


def _opener(config: pytest.Config, texts: Sequence[str] = ()) -> AbstractContextManager[Target]:
    """Return the target's context manager, not yet entered.

    Raises:
        UsageError: no such hand can be opened.
    """
    spec = _spec(config, texts)
    try:
        target: AbstractContextManager[Target] = _ours("hil.targets.opening").open_target(spec)
    except ValueError as error:
        raise pytest.UsageError(str(error)) from error
    return target
