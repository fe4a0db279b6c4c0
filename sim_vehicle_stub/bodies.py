"""The bodies of a fleet: one compiled call moves all of them, another reads what their sensors would say.

What a vehicle's firmware makes of setpoints and modes arrives here as a command: a velocity or a place
horizontally, a climb rate, a height or a landing vertically.  The motion itself is ``swarmctl.core.motion``.
Ground is flat, at height zero; every vehicle starts standing on it.  Firmware flies over the ground, so a
steady wind shows only where it exceeds what the vehicle can fly against, and where nothing holds the place.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmctl.core.jit import kernel
from swarmctl.core.motion import against_wind, carry_on, climb_rate_towards, stand
from swarmctl.core.state import POSE
from swarmctl.core.wire import tell

Records = NDArray[Any]

BODY = POSE

# `powered`: motors run. `aim`: VELOCITY, PLACE or DRIFT. `lift`: CLIMB_RATE, HEIGHT or DESCENT. `east`,
# `north`: m/s or m. `up`: m/s or m. `speed`, `climb`, `descent`: limits of this manoeuvre.
COMMAND = np.dtype(
    [(name, "<i8") for name in ("powered", "aim", "lift")]
    + [(name, "<f8") for name in ("east", "north", "up", "speed", "climb", "descent", "landing")]
)

# `acceleration` where the vehicle gets faster, `braking` where slower, `approach` towards a place (m/s²);
# `speed` over the ground, `airspeed` through the air (m/s); `lag` (s) with which velocity is followed;
# `share` of a commanded velocity, and of its limit, that the vehicle comes to fly.
LIMITS = np.dtype(
    [
        (name, "<f8")
        for name in (
            "speed",
            "airspeed",
            "acceleration",
            "braking",
            "approach",
            "climb_acceleration",
            "lag",
            "share",
        )
    ]
)

VELOCITY, PLACE, DRIFT = 0, 1, 2
CLIMB_RATE, HEIGHT, DESCENT = 0, 1, 2

# Columns of what `read_sensors` fills: GLOBAL_POSITION_INT from `lat` to `vz`.
WIRE_COLUMNS = ("lat", "lon", "alt", "relative_alt", "vx", "vy", "vz")

SLOW_BELOW_M, FAST_ABOVE_M = 5.0, 10.0
"""A landing descends at full speed above the one height and at landing speed below the other."""
GRAVITY = 9.81


@kernel
def landing_rate(up: float, descent: float, landing: float) -> float:
    """Climb rate (m/s, negative) of a landing at height ``up``."""
    share = min(max((up - SLOW_BELOW_M) / (FAST_ABOVE_M - SLOW_BELOW_M), 0.0), 1.0)
    return -(landing + share * (descent - landing))


@kernel
def ground_velocity(
    body: Any, command: Any, limits: Any, wind_east: float, wind_north: float
) -> tuple[float, float]:
    """The horizontal velocity (m/s over the ground) that the command asks for and the wind allows."""
    c_east, c_north = command["east"], command["north"]
    if command["aim"] == DRIFT:
        return wind_east, wind_north
    if command["aim"] == VELOCITY:
        c_east *= limits["share"]
        c_north *= limits["share"]
    else:
        c_east -= body["east"]
        c_north -= body["north"]
        gap = math.sqrt(c_east * c_east + c_north * c_north)
        speed = climb_rate_towards(0.0, gap, command["speed"], command["speed"], limits["approach"])
        if gap > 0.0:
            c_east *= speed / gap
            c_north *= speed / gap
    if wind_east == 0.0 and wind_north == 0.0:
        return c_east, c_north
    return against_wind(c_east, c_north, limits["airspeed"], wind_east, wind_north)


@kernel
def move_one(
    bodies: Records, k: int, command: Any, limits: Any, wind_east: float, wind_north: float, dt: float
) -> None:
    """One vehicle, ``dt`` seconds further."""
    c_east, c_north = ground_velocity(bodies[k], command, limits, wind_east, wind_north)
    up, c_up = bodies[k]["up"], command["up"]
    if command["lift"] == HEIGHT:
        c_up = climb_rate_towards(
            up, c_up, command["climb"], command["descent"], limits["climb_acceleration"]
        )
    elif command["lift"] == DESCENT:
        c_up = landing_rate(up, command["descent"], command["landing"])
    if up <= 0.0 and c_up <= 0.0:
        stand(bodies, k)
        return
    fastest = limits["speed"] * limits["share"] if command["aim"] == VELOCITY else limits["speed"]
    carry_on(
        bodies, k, c_east, c_north, c_up, fastest, limits["acceleration"], limits["braking"], limits["lag"],
        command["climb"], command["descent"], limits["climb_acceleration"], dt,
    )  # fmt: skip


@kernel
def fall_one(bodies: Records, k: int, dt: float) -> None:
    """Without power: stand, or fall."""
    body = bodies[k]
    body["v_up"] -= GRAVITY * dt
    body["up"] += body["v_up"] * dt
    body["east"] += body["v_east"] * dt
    body["north"] += body["v_north"] * dt
    if body["up"] <= 0.0:
        stand(bodies, k)


@kernel
def move(
    bodies: Records, commands: Records, limits: Records, wind_east: float, wind_north: float,
    steps: int, dt: float,
) -> None:  # fmt: skip
    """All vehicles, ``steps`` times ``dt`` seconds further; the arrays have one row a vehicle."""
    for k in range(bodies.shape[0]):
        for _ in range(steps):
            if commands[k]["powered"] == 1:
                move_one(bodies, k, commands[k], limits[k], wind_east, wind_north, dt)
            else:
                fall_one(bodies, k, dt)


@kernel
def read_sensors(
    bodies: Records, wire: NDArray[np.int64], altitude_errors: NDArray[np.float64],
    origin_lat: float, origin_lon: float, origin_alt: float,
) -> None:  # fmt: skip
    """Fill ``wire`` (V, 7): places in 1e-7 degrees, heights in mm, speeds north, east, down in cm/s.

    ``altitude_errors`` (V,): metres by which each vehicle's altitude above sea level reads too high.
    """
    for k in range(bodies.shape[0]):
        body = bodies[k]
        wire[k, 0], wire[k, 1], wire[k, 2], wire[k, 3], wire[k, 4], wire[k, 5], wire[k, 6] = tell(
            body["east"], body["north"], body["up"], body["v_east"], body["v_north"], body["v_up"],
            origin_lat, origin_lon, origin_alt, altitude_errors[k],
        )  # fmt: skip
