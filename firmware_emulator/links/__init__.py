"""Links to an emulated hand: in-process on virtual time, or over a pseudo-terminal in real time."""

from types import TracebackType
from typing import Self


class Closing:
    """Context manager that calls `close` on exit."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release all resources; a second call does nothing."""
        raise NotImplementedError
