"""Virtual time for those who have threads and clocks of their own, as MAVSDK has: it passes only while the loop waits.

Waiting takes a tenth of its time by the wall, and what work takes counts for nothing: however busy the machine
is, no deadline is missed.
"""

import selectors
import time
from typing import Any

from .virtual import VirtualLoop

PACE = 10.0
"""Virtual seconds a second of waiting."""


class _Paced(selectors.DefaultSelector):
    """Waits a tenth of the time that it is told; what is there wakes it."""

    now = 0.0

    def select(self, timeout: float | None = None) -> list[Any]:
        assert timeout is not None, "everything waits, and nothing is due"
        began = time.monotonic()
        ready = super().select(timeout / PACE)
        self.now += min(timeout, (time.monotonic() - began) * PACE)
        return ready


class PacedLoop(VirtualLoop):
    """An event loop on paced time, from 0."""

    def __init__(self) -> None:
        super().__init__(_Paced())
