"""How old a position is, by a vehicle's own clock that does not run as ours does."""

from types import SimpleNamespace

import pytest

from swarmctl.vehicle.reading import read_clock, read_position
from swarmctl.vehicle.telemetry import Telemetry

DELAY_S = 0.02


def position(telemetry: Telemetry, now: float, boot_s: float) -> None:
    """It comes at ``now``, and was measured when the vehicle's clock showed ``boot_s``."""
    fields = SimpleNamespace(
        lat=1, lon=1, alt=0, relative_alt=0, vx=0, vy=0, vz=0, time_boot_ms=round(boot_s * 1e3)
    )
    read_position(telemetry, fields, now)


@pytest.mark.parametrize("rate", [1.0, 0.98])
def test_a_clock_that_falls_behind_makes_no_position_old(rate: float) -> None:
    """PX4's simulator lost up to two seconds in a hundred."""
    telemetry = Telemetry()
    for tick in range(3000):
        now = 0.1 * tick
        if tick % 10 == 0:
            read_clock(telemetry, now - 2 * DELAY_S, rate * (now - DELAY_S))
        position(telemetry, now, rate * (now - DELAY_S))
        assert telemetry.age_s <= 3 * DELAY_S
    position(telemetry, 300.9, rate * 299.9)
    assert telemetry.age_s == pytest.approx(1.0, abs=3 * DELAY_S)


def test_positions_that_are_held_up_are_old_though_pings_are_too() -> None:
    telemetry = Telemetry()
    position(telemetry, 1.0, 1.0 - DELAY_S)
    for second in range(2, 60):
        read_clock(telemetry, second - 3.0, second - 1.5)  # a round trip of three seconds
        position(telemetry, float(second), second - 1.5)
        assert telemetry.age_s == pytest.approx(1.5, abs=2 * DELAY_S)
