"""A key, a date and clocks that tests of signed links share."""

from collections.abc import Callable
from typing import Any

from sim_vehicle_stub.fleet import StubFleet
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import Signing, units
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .stub_flight import ORIGIN, StubFlight

KEY, OTHER_KEY = bytes(range(32)), bytes(range(1, 33))
DATE_S = 1_764_072_000.0
"""Seconds since 1970 at time zero."""


def ticking(now: Callable[[], float] = lambda: 0.0, key: bytes = KEY, date_s: float = DATE_S) -> Signing:
    """A holder of a key with a clock of its own."""
    return Signing(key, lambda: units(date_s + now()))


def signed_flight(
    autopilot: str = "px4", vehicle_key: bytes | None = KEY, date_s: float = DATE_S
) -> StubFlight:
    """A session that signs, and a stub vehicle with a key; ``date_s`` is what the vehicle takes it for."""
    fleet = StubFleet(
        1, origin=ORIGIN, pads_m=[(0.0, 0.0)], autopilot=autopilot, key=vehicle_key, date_s=date_s
    )
    rig = StubFlight(fleet=fleet)
    rig.session = Session(1, settings=SessionSettings(), now=0.0, signing=ticking(lambda: rig.now))
    return rig


def beat(system: int, component: int = 1) -> bytes:
    """A vehicle's heartbeat, unsigned."""
    return Encoder(system, component).heartbeat(mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4, 0, 0, 4)


def set_up(key: bytes, time: int) -> Any:
    """The message that gives vehicle 1 a key."""
    return mav.MAVLink_setup_signing_message(1, 1, list(key), time)
