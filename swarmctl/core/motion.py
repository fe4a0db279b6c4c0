"""How a multicopter moves: the one model that the stub, the study and the guard's prediction share.

Horizontally the vehicle follows a velocity command with a first-order lag, its acceleration and speed
bounded in every direction alike; so braking from any velocity runs straight along that velocity.
Vertically it follows a climb rate within its own limits.  All in metres, seconds, an east-north-up frame.
"""

import math

from .arrays import Records
from .jit import inlined_kernel, kernel

AIRSPEED_SHARE = 1.25
"""What a vehicle can fly through the air, as a share of its speed: against the wind it flies the ground speed told."""


@inlined_kernel
def horizontal(
    east: float, north: float, v_east: float, v_north: float,
    c_east: float, c_north: float, speed: float, acceleration: float, lag: float, dt: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Position and velocity after ``dt`` seconds of the velocity command ``(c_east, c_north)``.

    ``speed`` (m/s) bounds the command, ``acceleration`` (m/s²) the change, ``lag`` (s) is the time constant
    with which the command is followed (0: at once).
    """
    size = math.sqrt(c_east * c_east + c_north * c_north)
    if size > speed:
        c_east *= speed / size
        c_north *= speed / size
    gain = dt / lag if lag > dt else 1.0
    d_east = gain * (c_east - v_east)
    d_north = gain * (c_north - v_north)
    size = math.sqrt(d_east * d_east + d_north * d_north)
    if size > acceleration * dt:
        d_east *= acceleration * dt / size
        d_north *= acceleration * dt / size
    u_east = v_east + d_east
    u_north = v_north + d_north
    return (
        east + 0.5 * (v_east + u_east) * dt,
        north + 0.5 * (v_north + u_north) * dt,
        u_east,
        u_north,
    )


@inlined_kernel
def vertical(
    up: float, v_up: float, c_up: float, climb: float, descent: float, acceleration: float, dt: float
) -> tuple[float, float]:
    """Height and climb rate after ``dt`` seconds of the climb-rate command ``c_up``, within the limits."""
    c_up = min(max(c_up, -descent), climb)
    change = min(max(c_up - v_up, -acceleration * dt), acceleration * dt)
    return up + (v_up + 0.5 * change) * dt, v_up + change


@inlined_kernel
def against_wind(
    c_east: float, c_north: float, airspeed: float, wind_east: float, wind_north: float
) -> tuple[float, float]:
    """The velocity nearest to a commanded one for which the vehicle need not be faster through the air."""
    a_east, a_north = c_east - wind_east, c_north - wind_north
    size = math.sqrt(a_east * a_east + a_north * a_north)
    if size <= airspeed:
        return c_east, c_north
    return wind_east + a_east * airspeed / size, wind_north + a_north * airspeed / size


@inlined_kernel
def carry_on(
    bodies: Records, i: int, c_east: float, c_north: float, c_up: float, speed: float, acceleration: float,
    braking: float, lag: float, climb: float, descent: float, climb_acceleration: float, dt: float,
) -> None:  # fmt: skip
    """Move body ``i``, in the air, ``dt`` seconds further under a velocity and a climb-rate command.

    ``braking`` bounds the change of velocity (m/s²) where it gets slower.  On the ground it stands.
    """
    v_east, v_north = bodies[i].v_east, bodies[i].v_north
    slower = c_east * c_east + c_north * c_north < v_east * v_east + v_north * v_north
    change = braking if slower else acceleration
    bodies[i].east, bodies[i].north, bodies[i].v_east, bodies[i].v_north = horizontal(
        bodies[i].east, bodies[i].north, v_east, v_north, c_east, c_north, speed, change, lag, dt
    )
    bodies[i].up, bodies[i].v_up = vertical(
        bodies[i].up, bodies[i].v_up, c_up, climb, descent, climb_acceleration, dt
    )
    if bodies[i].up <= 0.0:
        stand(bodies, i)


@kernel
def stand(bodies: Records, i: int) -> None:
    """On the ground, at rest."""
    bodies[i].up, bodies[i].v_up = 0.0, 0.0
    bodies[i].v_east, bodies[i].v_north = 0.0, 0.0


@inlined_kernel
def climb_rate_towards(up: float, target: float, climb: float, descent: float, acceleration: float) -> float:
    """The climb rate (m/s) that brings a vehicle at height ``up`` to ``target`` and stops there."""
    gap = target - up
    stoppable = math.sqrt(acceleration * abs(gap))
    rate = min(stoppable, abs(gap))
    return min(rate, climb) if gap > 0.0 else -min(rate, descent)


@kernel
def stopping_distance(speed: float, braking: float, latency: float) -> float:
    """Metres from here to standstill at ``speed``, braking ``braking`` m/s² after ``latency`` seconds."""
    return speed * latency + speed * speed / (2.0 * braking)
