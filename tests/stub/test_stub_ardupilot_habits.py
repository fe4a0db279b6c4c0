"""What ArduCopter was seen to do beside what it is asked for: see docs/autopilots.md."""

from collections.abc import Callable
from typing import Any

import pytest

Make = Callable[..., Any]
GUIDED = 4
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
