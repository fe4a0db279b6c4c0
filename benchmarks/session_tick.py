"""What one tick of an engaged session costs: a position in, a setpoint out, a poll.  Aim: 10 µs.

python benchmarks/session_tick.py
"""

import time

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.autopilots.px4 import MODES
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

TICKS, REPEATS = 16_000, 5
ARMED = mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mav.MAV_MODE_FLAG_SAFETY_ARMED
ORIGIN = (473977420, 85455940, 488000)


class Vehicle:
    """Says just what brings a session to ENGAGED, without flying."""

    def __init__(self) -> None:
        self.encoder = Encoder(1, 1)
        self.now = 0.0

    def say(self, session: Session, *messages: object) -> None:
        """Deliver messages, a second later."""
        self.now += 0.5
        for message in messages:
            session.receive(self.encoder.encode(message), self.now)
        session.poll(self.now)
        session.outgoing()

    def heartbeat(self, mode: int, armed: bool) -> object:
        """HEARTBEAT of a PX4."""
        base = ARMED if armed else 1
        return mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_PX4, base, mode, 4, 3)

    def position(self, height_m: float) -> object:
        """GLOBAL_POSITION_INT over the origin."""
        alt = ORIGIN[2] + round(height_m * 1000)
        return mav.MAVLink_global_position_int_message(1, *ORIGIN[:2], alt, alt - ORIGIN[2], 0, 0, 0, 0)


def acknowledge(number: int) -> object:
    """COMMAND_ACK: accepted."""
    return mav.MAVLink_command_ack_message(number, 0, 0, 0, 255, 190)


def engaged() -> tuple[Session, Vehicle]:
    """A session that has just come to ENGAGED, and its vehicle."""
    session, vehicle = Session(1, settings=SessionSettings(), now=0.0), Vehicle()
    q = [1.0, 0.0, 0.0, 0.0]
    known = (
        mav.MAVLink_extended_sys_state_message(0, mav.MAV_LANDED_STATE_ON_GROUND),
        mav.MAVLink_sys_status_message(0, 0, mav.MAV_SYS_STATUS_PREARM_CHECK, 0, 0, -1, 90, 0, 0, 0, 0, 0, 0),
        mav.MAVLink_gps_global_origin_message(*ORIGIN),
        mav.MAVLink_home_position_message(*ORIGIN, 0, 0, 0, q, 0, 0, 0),
        vehicle.position(0.0),
    )
    vehicle.say(session, vehicle.heartbeat(MODES.hold, False), acknowledge(mav.MAV_CMD_REQUEST_MESSAGE))
    empty = [0] * 8
    vehicle.say(session, mav.MAVLink_autopilot_version_message(0, 0, 0, 0, 0, empty, empty, empty, 0, 0, 0))
    while session.phase is not Phase.READY:
        still = vehicle.heartbeat(MODES.hold, False)
        vehicle.say(session, still, acknowledge(mav.MAV_CMD_SET_MESSAGE_INTERVAL), *known)
    session.take_off(20.0)
    climbing = vehicle.heartbeat(MODES.take_off, True)
    in_air = mav.MAVLink_extended_sys_state_message(0, mav.MAV_LANDED_STATE_IN_AIR)
    vehicle.say(session, acknowledge(mav.MAV_CMD_NAV_TAKEOFF), climbing, in_air, vehicle.position(20.0))
    session.engage()
    while session.phase is not Phase.ENGAGED:
        vehicle.say(session, vehicle.heartbeat(MODES.engaged, True))
    return session, vehicle


def measure() -> float:
    """Microseconds a tick over a whole search; the outgoing frames are drained as a flight drains them.

    The heartbeat that comes every tenth tick is not counted.
    """
    session, vehicle = engaged()
    lat, lon, alt = ORIGIN
    now, spent = vehicle.now, 0.0
    for i in range(TICKS):
        now += 0.1
        frame = vehicle.encoder.global_position_int(
            i * 100, lat + i, lon - i, alt + 20_000, 20_000, 500, 100, 0, 0
        )
        start = time.perf_counter()
        session.receive(frame, now)
        session.poll(now)
        session.setpoint(5.0, 1.0, 20.0)
        session.outgoing()
        spent += time.perf_counter() - start
        if i % 10 == 0:
            session.receive(vehicle.encoder.encode(vehicle.heartbeat(MODES.engaged, True)), now)
            session.traffic()
    figures = session.statistics()
    assert (figures.setpoints_sent, figures.messages_late, figures.messages_lost) == (TICKS, 0, 0)
    assert session.telemetry.lat_e7 == lat + TICKS - 1
    return spent / TICKS * 1e6


def main() -> None:
    """Print the best and the median of a few searches."""
    figures = sorted(measure() for _ in range(REPEATS))
    best, median = figures[0], figures[REPEATS // 2]
    print(f"session tick: best {best:.2f} µs, median {median:.2f} µs of {REPEATS} searches; aim 10 µs")


if __name__ == "__main__":
    main()
