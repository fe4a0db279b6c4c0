"""Sessions and real stub vehicles back to back: frames both ways, on one clock that counts ticks.

Nothing here plays the vehicle's part: what a session meets is the stub, with the manners of its firmware.
"""

import math
from collections.abc import Callable
from typing import Any

from sim_vehicle_stub.fleet import StubFleet
from swarmctl.mavlink.codec import Decoder, Encoder, Frame
from swarmctl.mavlink.dialect import mav
from swarmctl.vehicle.events import Event, EventKind
from swarmctl.vehicle.link import GROUND_SYSTEM
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.preflight import Preflight
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

ORIGIN = (47.3977, 8.5456, 488.0)
SPACING_M = 20.0
SCATTERED = 9
"""A seed by which altitudes and local origins scatter between vehicles."""
LIMIT_S = 120.0
PILOT = 254
"""The system id of another ground station."""
SETPOINT: int = mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED
SET_MODE, ARM_DISARM = mav.MAV_CMD_DO_SET_MODE, mav.MAV_CMD_COMPONENT_ARM_DISARM
BOTH = ("px4", "ardupilot")


class StubFlight:
    """One session a vehicle; the first of each has a name of its own.

    ``autopilots``: what the vehicles play, unless there is a ``fleet``.  ``speed``: how many times faster the
    fleet's time runs than the sessions'.  ``drop``: which frames do not arrive, either way.  ``each_tick`` is
    called when the sessions have heard everything of a tick.
    """

    def __init__(
        self,
        *autopilots: str,
        seed: int | None = None,
        tick_s: float = 0.1,
        speed: float = 1.0,
        preflight: Preflight | None = None,
        fleet: StubFleet | None = None,
        **settings: float,
    ) -> None:
        autopilots = autopilots or ("px4",)
        count = len(autopilots)
        pads = [(SPACING_M * k, 0.0) for k in range(count)]
        self.fleet = fleet or StubFleet(count, origin=ORIGIN, pads_m=pads, autopilot=autopilots, seed=seed)
        wanted = SessionSettings(time_scale=speed, **settings)
        self.sessions = [
            Session(v.system, settings=wanted, now=0.0, preflight=preflight) for v in self.fleet.vehicles
        ]
        self.events: list[Event] = []
        self.drop: Callable[[bytes], bool] = lambda frame: False
        self.each_tick: Callable[[], Any] = lambda: None
        self.ticks = 0
        self._tick_s, self._speed = tick_s, speed
        self._pilot = Encoder(PILOT, 190)
        self._decoder = Decoder()
        self._crossed: list[tuple[float, Frame]] = []
        self._to_decode: list[tuple[float, bytes]] = []

    # The first vehicle

    @property
    def session(self) -> Session:
        return self.sessions[0]

    @session.setter
    def session(self, session: Session) -> None:
        self.sessions[0] = session

    @property
    def vehicle(self) -> Any:
        return self.fleet.vehicles[0]

    @property
    def body(self) -> Any:
        """The truth of the first vehicle."""
        return self.fleet.truth[0]

    @property
    def mode(self) -> int:
        return int(self.vehicle.personality.custom_mode)

    @property
    def speed_mps(self) -> float:
        return math.hypot(self.body["v_east"], self.body["v_north"])

    # Time

    @property
    def now(self) -> float:
        """Seconds of the sessions' clock."""
        return round(self.ticks * self._tick_s, 6)

    def tick(self) -> None:
        self.ticks += 1
        now, fleet_now = self.now, self.now * self._speed
        self.fleet.advance(fleet_now)
        pairs = list(zip(self.fleet.vehicles, self.sessions, strict=True))
        for vehicle, session in pairs:
            for data in vehicle.outgoing():
                if not self.drop(data):
                    session.receive(data, now)
            session.poll(now)
        self.each_tick()
        for vehicle, session in pairs:
            for data in session.outgoing():
                if not self.drop(data):
                    vehicle.receive(data, fleet_now)
            self.events += session.events()
            self._to_decode += [(now, raw) for raw in session.traffic()]

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self._tick_s)):
            self.tick()

    def until(self, condition: Callable[[], bool], limit_s: float = LIMIT_S) -> float:
        """Let time pass until ``condition``; the seconds it took."""
        start = self.now
        while not condition():
            assert self.now - start < limit_s, [f"{s.phase} {s.reason}" for s in self.sessions]
            self.tick()
        return self.now - start

    def until_phase(self, phase: Phase, limit_s: float = LIMIT_S) -> float:
        """Let time pass until every session is in ``phase``; the seconds it took."""
        return self.until(lambda: all(session.phase is phase for session in self.sessions), limit_s)

    # What is done

    def hold_at(self, altitude_m: float = 20.0) -> None:
        """Get ready, take off, hold."""
        self.until_phase(Phase.READY)
        for session in self.sessions:
            session.take_off(altitude_m)
        self.until_phase(Phase.HOLDING)

    def engage(self, altitude_m: float = 20.0) -> None:
        """Get ready, take off, take control."""
        self.hold_at(altitude_m)
        for session in self.sessions:
            session.engage()
        self.until_phase(Phase.ENGAGED)

    def command(self, v_east: float, v_north: float, altitude_m: float = 20.0) -> None:
        """From now on every session that is engaged sends this setpoint at every tick."""
        self.each_tick = lambda: [s.setpoint(v_east, v_north, altitude_m) for s in self.sessions]

    def land(self) -> None:
        """Order all to land, and see them down and disarmed."""
        for session in self.sessions:
            session.land()
        self.until_phase(Phase.LANDED)
        assert not any(vehicle.armed for vehicle in self.fleet.vehicles)
        assert not self.fleet.truth["up"].any()

    def impair(self, **impairments: float | bool) -> None:
        """Spoil the first vehicle's network (`sim_vehicle_stub.network.Impairments`)."""
        self.vehicle.network.impair(**impairments)

    def set_parameter(self, name: str, value: float) -> None:
        """As its owner would have set it before."""
        self.vehicle.parameters.set(name, value)
        self.vehicle.personality.parameter_changed(name)

    # Another ground station

    def pilot_sends(self, message: Any) -> None:
        """Somebody else sends the first vehicle a message."""
        self.vehicle.receive(self._pilot.encode(message), self.now * self._speed)

    def pilot_commands(self, number: int, *parameters: float) -> None:
        """Somebody else sends it a COMMAND_LONG."""
        filled = [*parameters, *[0.0] * (7 - len(parameters))]
        self.pilot_sends(mav.MAVLink_command_long_message(1, 1, number, 0, *filled))

    def pilot_sets_mode(self, mode: int) -> None:
        """Somebody else chooses a mode; either firmware takes its number so."""
        self.pilot_sends(mav.MAVLink_set_mode_message(1, 1, mode))

    # What was seen

    @property
    def crossed(self) -> list[tuple[float, Frame]]:
        """Every frame of the sessions and of those they heard, with the time; decoded when somebody looks."""
        for now, raw in self._to_decode:
            self._crossed += [(now, frame) for frame in self._decoder.feed(raw)]
        self._to_decode.clear()
        return self._crossed

    def texts(self, *kinds: EventKind) -> list[str]:
        return [event.text for event in self.events if event.kind in kinds]

    def sent(self, message_id: int, since: float = 0.0) -> list[Any]:
        """The fields of what the sessions sent."""
        return [
            f.fields
            for t, f in self.crossed
            if t >= since and f.message_id == message_id and f.system == GROUND_SYSTEM
        ]

    def commands(self, number: int, since: float = 0.0) -> list[Any]:
        """The COMMAND_LONGs of this number that the sessions sent."""
        return [f for f in self.sent(mav.MAVLINK_MSG_ID_COMMAND_LONG, since) if f.command == number]

    def told(self, message_id: int, since: float = 0.0) -> list[Any]:
        """The fields of what the vehicles sent."""
        return [
            f.fields
            for t, f in self.crossed
            if t >= since and f.message_id == message_id and f.system < PILOT
        ]

    def acknowledged(self, number: int) -> list[int]:
        """The results that the vehicles gave a command of the sessions."""
        return [f.result for f in self.told(mav.MAVLINK_MSG_ID_COMMAND_ACK) if f.command == number]

    def check_not_fought(self, seconds: float) -> None:
        """For so long the sessions send nothing but heartbeats, and what measures the link."""
        since = self.now + 1e-6
        self.run(seconds)
        quiet = {mav.MAVLINK_MSG_ID_HEARTBEAT, mav.MAVLINK_MSG_ID_TIMESYNC}
        assert {f.message_id for t, f in self.crossed if t >= since and f.system == GROUND_SYSTEM} <= quiet
