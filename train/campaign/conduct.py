"""Running many trials: on the cores of this machine, or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed
from contextlib import AbstractContextManager, contextmanager
from ipaddress import ip_address
from urllib.parse import urlsplit

from aero.exit_code import Exit
from train.campaign.trial import Outcome, Trial, perform

PLAIN, ENCRYPTED = {"tcp", "ws"}, {"tls", "wss"}
"""Schemes of Dask's addresses."""
ATTEMPTS = 3
"""Times that workers may die without one trial coming to its end."""


class NoSchedulerError(ValueError):
    """No Dask scheduler can be used at an address; the message says why."""

    exit_code = Exit.USAGE


def check_address(scheduler: str) -> None:
    """See that a scheduler's address is safe to use.

    Dask's workers execute what anyone sends who reaches their ports or the scheduler's. So over a network the address
    has to be encrypted and authenticated (`tls://`, with Dask's own certificates).

    Raises:
        NoSchedulerError: it is no address, or is neither on this machine nor TLS.
    """
    try:
        parts = urlsplit(scheduler)
        host, _ = parts.hostname, parts.port
    except ValueError as error:
        raise NoSchedulerError(f"{scheduler!r} is no address of a Dask scheduler: {error}") from error
    if parts.scheme not in PLAIN | ENCRYPTED or not host:
        raise NoSchedulerError(
            f"{scheduler!r} is no address of a Dask scheduler; write tcp://HOST:PORT or tls://HOST:PORT"
        )
    if parts.scheme in PLAIN and not _on_this_machine(host):
        raise NoSchedulerError(
            f"{scheduler} is a plain address on a network, where whoever reaches the ports of its workers can run "
            "programs on them; use tls://"
        )


def _on_this_machine(host: str) -> bool:
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@contextmanager
def cluster(scheduler: str) -> Iterator[Executor]:
    """Yield the workers of a Dask cluster, which restarts a trial whose worker has died.

    Raises:
        NoSchedulerError: no scheduler answers at that address.
    """
    from distributed import Client  # noqa: PLC0415 - only a cluster needs it

    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        raise NoSchedulerError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    with client:
        yield client.get_executor(pure=False)


def conduct(
    trials: Sequence[Trial],
    executor: Callable[[], AbstractContextManager[Executor]],
    on_outcome: Callable[[Outcome], None],
) -> None:
    """Run trials and hand over each outcome as it comes.

    A worker that dies loses nothing: what it had begun is run again by the next workers.

    Args:
        trials: what to run, none twice.
        executor: a context manager that yields workers; called again when they have died.
        on_outcome: called in this process, once for each trial.

    Raises:
        ValueError: a trial names something that does not exist.
        RuntimeError: the workers die again and again.
    """
    left, attempts = {trial.key: trial for trial in trials}, 0
    while left:
        before = len(left)
        try:
            with executor() as workers:
                for future in as_completed([workers.submit(perform, trial) for trial in left.values()]):
                    outcome = future.result()
                    on_outcome(outcome)
                    del left[outcome.trial.key]
        except BrokenExecutor as error:
            attempts = attempts + 1 if len(left) == before else 0
            if attempts == ATTEMPTS:
                raise RuntimeError(f"the workers died {ATTEMPTS} times over {next(iter(left))}") from error
