"""A serial adapter that can be unplugged, and a line behind it that carries so many bytes a second.

The device is a link to a pseudo-terminal of this process, which a thread joins with the pseudo-terminal of a
stub vehicle.
"""

import math
import os
import select
import threading
import time
import tty
from pathlib import Path

LOOK_S = 0.005
MOST_WAITING_S = 0.5


class _Direction:
    """One way of the line.  ``counts``: when how many bytes were offered to it."""

    def __init__(self, bytes_per_s: float) -> None:
        self.counts: list[tuple[float, int]] = []
        self._bytes_per_s = bytes_per_s
        self._waiting = bytearray()
        self._allowed = 0.0

    def offer(self, data: bytes) -> None:
        """Bytes enter; those that there is no room for are lost."""
        self.counts.append((time.monotonic(), len(data)))
        if len(self._waiting) < MOST_WAITING_S * self._bytes_per_s:
            self._waiting += data

    def take(self, passed_s: float) -> bytes:
        """What leaves after so much more time."""
        if not math.isinf(self._bytes_per_s):
            self._allowed = min(self._allowed + passed_s * self._bytes_per_s, 10 * LOOK_S * self._bytes_per_s)
        size = len(self._waiting) if math.isinf(self._bytes_per_s) else int(self._allowed)
        data = bytes(self._waiting[:size])
        del self._waiting[:size]
        self._allowed -= len(data)
        return data


class SerialLine:
    """The adapter ``path``, joined with the vehicle's pseudo-terminal ``vehicle``; each way ``bytes_per_s``."""

    def __init__(self, path: Path, vehicle: str, bytes_per_s: float = math.inf) -> None:
        self.path = path
        self.from_vehicle, self.to_vehicle = _Direction(bytes_per_s), _Direction(bytes_per_s)
        self._vehicle = os.open(vehicle, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._own: int | None = None
        self._theirs = -1
        self._lock = threading.Lock()
        self._over = threading.Event()
        self.plug()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def plug(self) -> None:
        """Plug the adapter in."""
        with self._lock:
            self._own, self._theirs = os.openpty()
            tty.setraw(self._theirs)
            os.set_blocking(self._own, False)
            self.path.symlink_to(os.ttyname(self._theirs))

    def unplug(self) -> None:
        """Pull it out."""
        with self._lock:
            assert self._own is not None
            os.close(self._own)
            os.close(self._theirs)
            self._own = None
            self.path.unlink()

    def close(self) -> None:
        """Take everything down."""
        self._over.set()
        self._thread.join()
        if self._own is not None:
            self.unplug()
        os.close(self._vehicle)

    def _carry(self) -> None:
        before = time.monotonic()
        while not self._over.wait(LOOK_S):
            now = time.monotonic()
            with self._lock:
                self._move(self._vehicle, self._own, self.from_vehicle, now - before)
                self._move(self._own, self._vehicle, self.to_vehicle, now - before)
            before = now

    def _move(self, source: int | None, sink: int | None, direction: _Direction, passed_s: float) -> None:
        if source is not None and select.select([source], [], [], 0)[0]:
            direction.offer(os.read(source, 65536))
        data = direction.take(passed_s)
        if sink is not None and data and select.select([], [sink], [], 0)[1]:
            os.write(sink, data)
