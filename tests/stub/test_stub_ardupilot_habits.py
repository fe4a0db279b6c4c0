"""What ArduCopter was seen to do beside what it is asked for: see docs/autopilots.md."""

from collections.abc import Callable
from typing import Any

import pytest

Make = Callable[..., Any]
GUIDED, RTL = 4, 6
NONE_SELECTED = "Arm: Fences enabled, but none selected"


@pytest.mark.parametrize(("types", "arms"), [(4, False), (7, True)])
def test_a_fence_of_nothing_bars_arming(station: Make, types: int, arms: bool) -> None:
    """FENCE_TYPE 4 is the fence on board alone; with a ceiling or a circle besides there is something."""
    s = station(autopilot="ardupilot")
    s.run(42.0)
    s.set_parameter("FENCE_TYPE", types)
    s.set_parameter("FENCE_ENABLE", 1)
    assert s.command(176, 1, GUIDED) == [0]
    assert (s.arm() == [0]) == arms
    assert (NONE_SELECTED in s.texts()) != arms


def test_a_breach_is_told_and_so_is_its_end(station: Make) -> None:
    s = station(autopilot="ardupilot")
    s.fly_guided(10.0)
    assert s.put_fence(-20.0, 20.0) == 0
    for name, value in {"AVOID_ENABLE": 0, "FENCE_TYPE": 4, "FENCE_ACTION": 1, "FENCE_ENABLE": 1}.items():
        s.set_parameter(name, value)
    velocity = 1 | 2 | 4 | 64 | 128 | 256 | 2048
    s.run_until(lambda: s.mode == RTL, 30.0, lambda: s.setpoint(v_east=5.0, mask=velocity))
    assert "Polygon fence breached" in s.texts() and "Fence breach cleared" not in s.texts()
    s.run(30.0)
    assert "Fence breach cleared" in s.texts()
