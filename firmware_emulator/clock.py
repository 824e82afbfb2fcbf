"""Virtual time: the clock whose waiting runs the emulated hand."""

from __future__ import annotations

from firmware_emulator.kernel import Kernel


class VirtualClock:
    """Owns time by running the kernel; has the shape of the driver's clock."""

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel

    def now(self) -> float:
        """Return the virtual time in s."""
        return self._kernel.now

    def sleep_until(self, t: float) -> None:
        """Run everything up to `t` (s); nothing happens when it is past."""
        if t > self._kernel.now:
            self._kernel.run_until(t)
