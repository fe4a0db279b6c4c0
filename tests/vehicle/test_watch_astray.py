"""When a vehicle counts as not flying its setpoints: never for dodging, turning or being slow."""

import math
from collections.abc import Callable

import pytest

from swarmctl.vehicle.settings import SessionSettings
from swarmctl.vehicle.telemetry import Telemetry
from swarmctl.vehicle.watch import Watch

TICK_S = 0.1
Motion = Callable[[float], tuple[float, float]]


def first_told(told: Motion, flown: Motion, seconds: float = 120.0) -> float | None:
    """When it is first said, in s; None: never."""
    watch, telemetry = Watch(SessionSettings()), Telemetry()
    for k in range(round(seconds / TICK_S)):
        now = k * TICK_S
        telemetry.v_east, telemetry.v_north = flown(now)
        if watch.astray(*told(now), telemetry, now):
            return now
    return None


def still(now: float) -> tuple[float, float]:
    return 0.0, 0.0


def east(now: float) -> tuple[float, float]:
    return 12.0, 0.0


def circling(period_s: float, late_s: float = 0.0, share: float = 1.0) -> Motion:
    """Round and round at 12 m/s, ``late_s`` behind, at a share of the speed."""

    def motion(now: float) -> tuple[float, float]:
        angle = 2.0 * math.pi * (now - late_s) / period_s
        return 12.0 * share * math.cos(angle), 12.0 * share * math.sin(angle)

    return motion


def dodging(now: float) -> tuple[float, float]:
    """Another way at every tick, as among many others."""
    return (12.0, 0.0) if round(now / TICK_S) % 2 else (-12.0, 0.0)


@pytest.mark.parametrize(
    ("told", "flown"),
    [
        (east, still),
        (still, east),
        (east, lambda now: (-12.0, 0.0)),
        (lambda now: (-12.0, 2.0), east),
    ],
)
def test_the_contrary_is_told_after_ten_seconds(told: Motion, flown: Motion) -> None:
    said = first_told(told, flown)
    assert said is not None and 10.0 <= said < 18.0


@pytest.mark.parametrize(
    ("told", "flown"),
    [
        (dodging, still),
        (circling(20.0), circling(20.0, late_s=1.0)),
        (circling(6.0), circling(6.0, late_s=0.5, share=0.3)),
        (east, lambda now: (8.0, 1.0)),  # falls short
        (east, lambda now: (min(-25.0 + 1.5 * now, 12.0), 0.0)),  # slow to turn round
        (still, lambda now: (max(25.0 - 1.5 * now, 0.0), 0.0)),  # slow to stop
    ],
)
def test_what_obeys_is_never_accused(told: Motion, flown: Motion) -> None:
    assert first_told(told, flown) is None
