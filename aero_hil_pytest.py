"""Pytest plugin of aero-hil: options, marks, and the fixtures `aero_target`, `aero_hand` and `aero_session_target`.

Pytest loads the plugin in every environment with aero-hil, so tests without these fixtures must be unaffected: options
of the project have priority, marks apply only to tests with these fixtures, and packages are imported on first use. A
header line reports modules that hide packages of aero-hil.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import pytest

from aero_hil import hidden
from aero_hil_options import PluginOptions

if TYPE_CHECKING:
    from aero.hand import Hand
    from hil.emulated.lent_hand import LentHand, SharedHand
    from hil.emulated.pty_process import ServedPort
    from hil.targets.hand_spec import PortSpec
    from hil.targets.target import Target


def _seed(text: str) -> int:
    """Return a valid NumPy seed; pytest's parser turns the error into one line."""
    if not 0 <= int(text) < 2**32:
        raise ValueError
    return int(text)


OPTIONS = PluginOptions("aero-hil", "Aero Hand Open", taken=pytest.StashKey[list[str]](), options={
    "hil": {
        "metavar": "TARGET",
        "default": "emulated",
        "help": "hand to test: emulated (default, virtual time), pty (real time), path or pyserial URL of a port, or a "
        "name in hands.toml",
    },
    "hil-firmware": {"metavar": "VERSION", "help": "firmware of the hand (default: of hands.toml, else 0.2.0)"},
    "hil-side": {"choices": ("right", "left"), "help": "side (default: of hands.toml, else right)"},
    "hil-unit": {"metavar": "UNIT", "help": "emulated unit: shipped name or .toml (default reference)"},
    "hil-still": {"action": "store_true", "help": "skip tests that move the hand"},
    "hil-homing": {"action": "store_true", "help": "also run tests that home a hand in real time"},
    "hil-long": {"action": "store_true", "help": "also run tests that take long in real time"},
    "hil-seed": {"type": _seed, "default": 0, "help": "seed of the emulated hand's noise (default 0)"},
})  # fmt: skip
MARKERS = (
    "presence: a hand that fails this test is not tested further",
    "moves: moves the hand; skipped with --hil-still",
    "homes: drives the hand into its stops; on a hand in real time only with --hil-homing",
    "takes_long: takes more than a few seconds of hand time; in real time only with --hil-long",
    "needs_ground_truth: compares with what an emulated hand really does, `aero_target.truth`",
    "fault(text, ...): gets an emulated hand of its own with these faults, NAME[:CHANNEL][=SEVERITY][@SECONDS]",
)
SOFTWARE = ("emulated", "pty")
"""Targets that several test processes may open simultaneously."""
_PORT_OF: dict[str, dict[str, Any]] = {"emulated": {"port": "pty", "homed": False}, "pty": {"homed": False}}
"""Changes to the hand of `--hil` for `aero_port`: homing would take longer than a test."""
SLEPT = (
    "this test waited for {seconds:g} s of real time, in which the emulated hand's time stood still: it moved nothing; "
    "use `aero_target.clock.sleep_until(aero_target.clock.now() + SECONDS)`, which waits on any hand"
)
WIDER = "\naero-hil: a fixture of a wider scope than a function's takes `aero_session_target` in place of `aero_target`"

_SHARED: pytest.StashKey[SharedHand] = pytest.StashKey()
_LENT: pytest.StashKey[LentHand] = pytest.StashKey()
_NO_HAND = pytest.StashKey[str]()
"""Error that prevented opening the hand, in a worker of pytest-xdist."""
_FAILED = pytest.StashKey[str]()


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    """Add the options."""
    OPTIONS.add(parser, pluginmanager)


@pytest.hookimpl(wrapper=True)
def pytest_load_initial_conftests(
    early_config: pytest.Config, parser: pytest.Parser
) -> Generator[None, object, object]:
    """Add the short option names after those of the project's conftest files, which have priority."""
    result = yield
    OPTIONS.add_short_names(parser, early_config)
    return result


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers, and reject invalid options before any test process starts."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    option, name = config.option, config.option.aero_hil
    if name not in SOFTWARE and not hasattr(config, "workerinput") and _workers(config) > 1:
        raise pytest.UsageError(f"--hil={name}: one program at a time can use a hand; run without -n, or with -n 1")
    if name not in SOFTWARE or option.aero_hil_firmware is not None or option.aero_hil_unit is not None:
        _opener(config)


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Return a header line if the project hides packages of aero-hil."""
    if line := hidden():
        return [f"aero-hil is disabled: {line}"]
    return OPTIONS.header(config)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Generator[None, object, object]:
    """Run presence tests first and homing tests last, because homing changes the zero; keep all other tests in place.

    Runs after every other hook, so that marks added by collection hooks apply too.
    """
    result = yield
    places = [place for place, item in enumerate(items) if _uses(item)]
    ours = [items[place] for place in places]
    for item in (item for item in items if _uses(item) or _uses_port(item)):
        with _usage_errors(f"{item.nodeid}: "):
            for text in _fault_texts(item):
                _ours("hil.emulated.faults.catalogue").parse_fault(text)
    ours.sort(key=lambda item: (not item.get_closest_marker("presence"), bool(item.get_closest_marker("homes"))))
    for place, item in zip(places, ours, strict=True):
        items[place] = item
    return result


def pytest_report_collectionfinish(config: pytest.Config, items: list[pytest.Item]) -> str | list[str]:
    """Return a line that describes the hand under test, if any test uses one; a worker prints none."""
    shown = any(map(_uses, items)) and not hasattr(config, "workerinput")
    return f"aero-hil: {_spec(config).describe()}" if shown else []


def pytest_collection_finish(session: pytest.Session) -> None:
    """Open the hand before the first test, so that a missing hand is one error instead of one per test."""
    config = session.config
    if config.option.collectonly or not any(map(_uses, session.items)):
        return
    try:
        _shared(config)
    except pytest.UsageError as error:
        if not hasattr(config, "workerinput"):
            raise
        # pytest-xdist reports a worker that exits as a crash, so the first test raises the error instead.
        config.stash[_NO_HAND] = str(error)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip tests that this hand cannot run, before any fixture moves the hand."""
    if _uses(item):
        _refuse(item)
        if not _fault_texts(item):
            _give(item, _shared(item.config).target)


def _refuse(item: pytest.Item) -> None:
    """Skip or fail a test that this hand cannot run, with the reason."""
    stash = item.config.stash
    if _NO_HAND in stash:
        if _FAILED in stash:
            pytest.skip(stash[_NO_HAND])
        stash[_FAILED] = item.name
        pytest.fail(stash[_NO_HAND], pytrace=False)
    target = stash[_SHARED].target if _SHARED in stash else None
    marks, left_out = {mark.name for mark in item.iter_markers()}, _ours("hil.emulated.lent_hand").left_out
    if reason := left_out(marks, item.config.option, target, stash.get(_FAILED, "")):
        pytest.skip(reason)


def _give(item: pytest.Item, target: Target, faults: tuple[str, ...] = ()) -> None:
    """Record the hand of a test, for its report and teardown."""
    lent_hand = _ours("hil.emulated.lent_hand")
    if _LENT not in item.stash:
        item.user_properties += lent_hand.properties(target, _ours("hil.recordings.provenance").source_commit())
    item.stash[_LENT] = lent_hand.LentHand.of(target, faults)


def _count_from_now(item: pytest.Item) -> None:
    """Restart the counting of waits, in real time and in hand time."""
    if (lent := item.stash.get(_LENT, None)) is not None:
        item.stash[_LENT] = lent.from_now()


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(request: pytest.FixtureRequest) -> Generator[None, object, object]:
    """Undo a fixture's acts on the shared hand after the fixture's own teardown."""
    if (shared := request.config.stash.get(_SHARED, None)) is None:
        return (yield)
    before, mine = shared.present(), list[str]()
    request.addfinalizer(lambda: shared.end(mine))
    try:
        return (yield)
    finally:
        mine += [one for one in shared.present() if one not in before]
        shared.add(mine)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Fail a test whose mark `fault` was added too late, or that waited in real time without advancing hand time."""
    if "aero_target" not in getattr(item, "fixturenames", ()):  # waits of wider fixtures do not count
        _count_from_now(item)
    try:
        result = yield
    except BaseException as error:
        if words := _why_it_shows_nothing(item):
            error.add_note(words)
        raise
    if words := _why_it_shows_nothing(item):
        pytest.fail(words, pytrace=False)
    return result


def _why_it_shows_nothing(item: pytest.Item) -> str:
    """Return the reason why a test's result is invalid for its hand, or "" if valid."""
    if (lent := item.stash.get(_LENT, None)) is None:
        return ""
    if late := [text for text in _fault_texts(item) if text not in lent.faults]:
        return f"the mark fault({', '.join(late)}) came when the hand was open already: the hand has none of it"
    return SLEPT.format(seconds=round(slept, 2)) if (slept := lent.slept_s()) else ""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Generator[None, object, object]:
    """Record the acts of a test on the hand, and undo them after all its fixtures."""
    if (lent := item.stash.get(_LENT, None)) is not None:
        item.user_properties += lent.done()
    try:
        return (yield)
    finally:
        if (shared := item.config.stash.get(_SHARED, None)) is not None:
            shared.end_test()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Store a failed presence test, and name the fixture for wider scopes in scope errors."""
    report = yield
    if report.failed and item.get_closest_marker("presence") and _uses(item):
        item.config.stash[_FAILED] = item.name
    if report.failed and "ScopeMismatch" in (said := str(report.longrepr)) and "aero_" in said:
        report.longrepr = said + WIDER
    return report


@pytest.fixture(scope="session")
def _aero_hil(request: pytest.FixtureRequest) -> Callable[[], SharedHand]:
    """Opener of the session's hand; marks tests that use our fixtures, even overridden ones."""
    return lambda: _shared(request.config)


@pytest.fixture(scope="session")
def aero_session_target(_aero_hil: Callable[[], SharedHand]) -> Target:
    """Hand of the session, for fixtures of a wider scope than a function; in the state after earlier tests."""
    return _aero_hil().target


@pytest.fixture
def aero_target(request: pytest.FixtureRequest, _aero_hil: Callable[[], SharedHand]) -> Iterator[Target]:
    """Hand selected by `--hil` (see `hil.Target`), at rest; a separate hand for each test with faults."""
    item, texts = request.node, _fault_texts(request.node)
    _refuse(item)
    if not texts:
        shared = _aero_hil()
        if left := shared.left_behind():
            pytest.fail(f"an earlier test changed the hand: {', '.join(left)}", pytrace=False)
        _give(item, shared.target)
        yield shared.target
        return
    try:
        opening = _opener(request.config, texts)
    except pytest.UsageError as error:
        pytest.fail(f"aero_target: {error}", pytrace=False)
    with opening as target:
        _give(item, target, texts)
        yield target


@pytest.fixture(scope="session")
def _aero_hil_port(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[], Any]]:
    """Opener of the session's port; opened on first use, one for each process of pytest-xdist."""
    opened, ports = ExitStack(), list[Any]()

    def port() -> Any:
        if not ports:
            lent_port = _ours("hil.emulated.port_for_tests").lent_port
            spec = replace(_spec(request.config), **_PORT_OF.get(request.config.option.aero_hil, {}))
            ports.append(opened.enter_context(lent_port(spec, pytest.skip, tmp_path_factory.mktemp("stops"))))
        return ports[0]

    with opened:
        yield port


@pytest.fixture
def aero_port(request: pytest.FixtureRequest, _aero_hil_port: Callable[[], Any]) -> Iterator[ServedPort]:
    """Port of a new hand for a driver in any language: `path`, `url`, `inject`, `clear`, `act`, `telemetry`.

    With `--hil=PORT`, the path of that hand behind the guard.
    """
    _refuse(request.node)
    texts = _fault_texts(request.node)
    port: ServedPort = _aero_hil_port()
    port.renew(texts)
    yield port
    if texts:
        port.renew()  # fails for a fault without effect


@pytest.fixture
def aero_hand(request: pytest.FixtureRequest, aero_target: Target) -> Hand:
    """Driver of the target's hand, commanded open and at rest."""
    aero_target.hand.command_codes([0] * 7)
    if not _ours("hil.emulated.lent_hand").at_rest(aero_target):
        pytest.fail("the hand does not come to rest after it was commanded open")
    _count_from_now(request.node)
    return aero_target.hand


def _ours(name: str) -> Any:
    """Import a module of aero-hil; raise UsageError if it is hidden or a dependency is missing or cannot be loaded."""
    if line := hidden():
        raise pytest.UsageError(line)
    try:
        return import_module(name)
    except ImportError as error:
        said = import_module("hil.cli.exits").other_package(error)
        raise pytest.UsageError(f"aero-hil: {said or f'{error}; `pip install` the extra `suite`'}") from error
    except Exception as error:  # PyOpenGL raises any kind, for the library that MUJOCO_GL names
        code, line = (exits := import_module("hil.cli.exits")).ending(error)
        if code == exits.Exit.DEFECT:
            raise
        raise pytest.UsageError(f"aero-hil: {line}") from error


def _workers(config: pytest.Config) -> int:
    """Return the number of processes of pytest-xdist, from `-n` or `--tx 3*popen`."""
    counts = (spec.partition("*")[0] for spec in getattr(config.option, "tx", None) or () if spec)
    return sum(int(count) if count.isdigit() else 1 for count in counts)


def _uses(item: pytest.Item) -> bool:
    """Return whether a test uses a fixture of this file, as opposed to another one of equal name."""
    return "_aero_hil" in getattr(item, "fixturenames", ())


def _uses_port(item: pytest.Item) -> bool:
    return "_aero_hil_port" in getattr(item, "fixturenames", ())


def _fault_texts(item: pytest.Item) -> tuple[str, ...]:
    return tuple(str(text) for mark in item.iter_markers("fault") for text in mark.args)


def _shared(config: pytest.Config) -> SharedHand:
    """Return the hand of the session, opened on first use and once it is lost; raise UsageError if that fails."""
    if _SHARED in config.stash and config.stash[_SHARED].lost:
        config.stash[_SHARED].close()
        del config.stash[_SHARED]
    if _SHARED not in config.stash:
        opened = ExitStack()
        try:
            target = opened.enter_context(_opener(config))
        except Exception as error:
            code, line = (exits := _ours("hil.cli.exits")).ending(error)
            if code == exits.Exit.DEFECT and not isinstance(error, (pytest.UsageError, ValueError)):
                raise  # a defect needs its traceback
            raise pytest.UsageError(str(error) if code == exits.Exit.DEFECT else line) from error
        config.add_cleanup(opened.close)
        lent_hand = _ours("hil.emulated.lent_hand")
        # acts skip like tests with a mark `fault`
        config.stash[_SHARED] = lent_hand.shared(target, lambda _: pytest.skip(lent_hand.NOT_EMULATED), opened.close)
    return config.stash[_SHARED]


def _spec(config: pytest.Config, texts: Sequence[str] = ()) -> PortSpec:
    """Return the hand selected by the options, with these faults."""
    with _usage_errors("--hil: "):
        spec: PortSpec = _ours("hil.emulated.lent_hand").chosen(config.option, texts)
    return spec


def _opener(config: pytest.Config, texts: Sequence[str] = ()) -> AbstractContextManager[Target]:
    """Return the target's context manager, without entering it."""
    with _usage_errors():
        target: AbstractContextManager[Target] = _ours("hil.emulated.any_hand").open_target(_spec(config, texts))
    return target


@contextmanager
def _usage_errors(begin: str = "") -> Iterator[None]:
    """Turn the ValueError of an invalid option or mark into a UsageError."""
    try:
        yield
    except ValueError as error:
        raise pytest.UsageError(f"{begin}{error}") from error
