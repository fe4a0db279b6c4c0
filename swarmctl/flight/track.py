"""Where the vehicles truly were, tick by tick: what the summary's safety figures are computed from."""

import numpy as np

from swarmctl.core import state
from swarmctl.core.arrays import Floats, Records

AIRBORNE_M = 0.5
"""A vehicle higher than this over its ground is in the air."""


class Track:
    """A growing table of true poses, one row a tick."""

    def __init__(self, vehicles: int) -> None:
        self._size = 0
        self._times = np.zeros(4096)
        self._poses = np.zeros((4096, vehicles), state.POSE)

    def add(self, now: float, poses: Records) -> None:
        """Keep the poses (V,) POSE at ``now``."""
        if self._size == len(self._times):
            self._times = np.concatenate((self._times, np.zeros_like(self._times)))
            self._poses = np.concatenate((self._poses, np.zeros_like(self._poses)))
        self._times[self._size] = now
        self._poses[self._size].view(np.float64)[:] = poses.view(
            np.float64
        )  # field by field takes ten times as long
        self._size += 1

    @property
    def times_s(self) -> Floats:
        """Flight times, (K,)."""
        return self._times[: self._size]

    def field(self, name: str) -> Floats:
        """One field of all poses, (K, V)."""
        values: Floats = self._poses[name][: self._size]
        return values

    @property
    def airborne(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Who was in the air, (K, V)."""
        return np.asarray(self.field("up") > AIRBORNE_M)
