"""A battery that time in the air drains, and that may collapse."""

COLLAPSED_PERCENT, COLLAPSED_FOR_S = 5.0, 20.0
"""What a collapse leaves, and how long that still flies."""


class Battery:
    """One vehicle's battery; ``endurance_s`` seconds in the air drain it, None: it never drains."""

    def __init__(self, endurance_s: float | None) -> None:
        self._endurance_s = endurance_s
        self._airborne_s = 0.0
        self._collapsed = False

    @property
    def percent(self) -> float:
        """What is left."""
        if self._endurance_s is None:
            return 100.0
        return max(0.0, 100.0 - 100.0 * self._airborne_s / self._endurance_s)

    @property
    def empty(self) -> bool:
        """Whether the motors stop: after a collapse.  A sound battery flies on for a while at 0 %."""
        return self._collapsed and self.percent == 0.0

    def drain(self, airborne_s: float) -> None:
        """Fly for so many seconds."""
        self._airborne_s += airborne_s

    def collapse(self) -> None:
        """Lose all charge but a remainder that lasts some seconds."""
        self._collapsed = True
        self._endurance_s = COLLAPSED_FOR_S / (COLLAPSED_PERCENT / 100.0)
        self._airborne_s = self._endurance_s - COLLAPSED_FOR_S
