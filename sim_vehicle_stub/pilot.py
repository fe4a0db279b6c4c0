"""What a firmware's modes ask of the body: fly this velocity, go there, hold, land, rest.

One pilot writes one row of the fleet's commands and reads its row of the bodies.
"""

import math
from dataclasses import dataclass

from swarmctl.core.motion import AIRSPEED_SHARE

from . import bodies
from .bodies import Records


@dataclass(frozen=True)
class Limits:
    """What a vehicle can do at most; the defaults are PX4's."""

    speed_mps: float = 12.0
    acceleration_mps2: float = 3.0
    climb_mps: float = 3.0
    descent_mps: float = 1.5
    lag_s: float = 0.2
    climb_acceleration_mps2: float = 3.0
    endurance_s: float | None = None
    """Seconds in the air that drain the battery; None: it never drains."""
    braking_mps2: float | None = None
    """None: as the acceleration."""
    airspeed_mps: float | None = None
    """What it can fly through the air, for the wind; None: a quarter more than its speed."""
    velocity_share: float = 1.0
    """What it comes to fly of a commanded velocity: firmware may never quite make up for its drag."""

    @property
    def braking(self) -> float:
        """m/s²."""
        return self.acceleration_mps2 if self.braking_mps2 is None else self.braking_mps2

    @property
    def airspeed(self) -> float:
        """m/s."""
        return AIRSPEED_SHARE * self.speed_mps if self.airspeed_mps is None else self.airspeed_mps


class Pilot:
    """The controls of one body, in metres and m/s of the fleet's east-north-up frame."""

    def __init__(self, commands: Records, limits: Records, index: int) -> None:
        self.place = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        """east, north, up, and their rates: as they were at the last tick."""
        self.broken = False
        self._index = index
        self._command = commands[index]
        self._limits = limits[index]
        self._aim = commands["aim"]
        self._lift = commands["lift"]
        self._east = commands["east"]
        self._north = commands["north"]
        self._up = commands["up"]

    @property
    def powered(self) -> bool:
        """Whether the motors run."""
        return bool(self._command["powered"])

    def power(self, on: bool) -> None:
        """Start the motors, standing still; or stop them."""
        self._command["powered"] = int(on and not self.broken)
        self.velocity(0.0, 0.0)
        self.climb_rate(0.0)

    def break_motors(self, broken: bool) -> None:
        """Let the motors fail, whatever the firmware believes; or mend them, still stopped."""
        self.broken = broken
        if broken:
            self._command["powered"] = 0

    def limit(self, name: str, value: float) -> None:
        """Set one limit of the body (a field of `bodies.LIMITS`)."""
        self._limits[name] = value

    def pace(self, speed: float, climb: float, descent: float, landing: float) -> None:
        """Set the limits of the present manoeuvre: way to a place, climb, descent, touch-down (all m/s)."""
        command = self._command
        command["speed"], command["climb"] = speed, climb
        command["descent"], command["landing"] = descent, landing

    def velocity(self, east: float, north: float) -> None:
        """Fly this horizontal velocity (m/s)."""
        index = self._index
        self._aim[index] = bodies.VELOCITY
        self._east[index] = east
        self._north[index] = north

    def go_to(self, east: float, north: float) -> None:
        """Go to this place (m) and stay there."""
        index = self._index
        self._aim[index] = bodies.PLACE
        self._east[index] = east
        self._north[index] = north

    def drift(self) -> None:
        """Go with the wind: there is no position to hold."""
        self._aim[self._index] = bodies.DRIFT

    def climb_rate(self, up: float) -> None:
        """Climb at this rate (m/s)."""
        index = self._index
        self._lift[index] = bodies.CLIMB_RATE
        self._up[index] = up

    def height(self, up: float) -> None:
        """Go to this height (m) and stay there."""
        index = self._index
        self._lift[index] = bodies.HEIGHT
        self._up[index] = up

    def descend(self) -> None:
        """Descend until the ground is met."""
        self._lift[self._index] = bodies.DESCENT

    def hold(self) -> None:
        """Brake, and stay where that ends."""
        east, north, up, v_east, v_north, v_up = self.place
        limits = self._limits
        speed = math.sqrt(v_east * v_east + v_north * v_north)
        ahead = limits["lag"] + speed / (2.0 * limits["braking"])
        self.go_to(east + v_east * ahead, north + v_north * ahead)
        self.height(up + v_up * abs(v_up) / (2.0 * limits["climb_acceleration"]))
