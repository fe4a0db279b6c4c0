"""The only place of a flight that reads a clock; everything else is told the time."""

import time
from datetime import datetime


def wall_s() -> float:
    """Seconds of a clock that never goes back."""
    return time.perf_counter()


def utc_s() -> float:
    """Seconds since 1970, by a clock that may be wrong and may be set."""
    return time.time()


def today() -> datetime:
    """The local date and time, for naming a run."""
    return datetime.now()
