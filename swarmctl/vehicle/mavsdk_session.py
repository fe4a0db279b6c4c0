"""A session whose vehicle MAVSDK handles: the same phases, steps and watches, another hand on the controls.

MAVSDK does what is done to the vehicle (see ``mavsdk_deeds``) and is its ground station: its heartbeats, its
repetitions, its reading of acknowledgements.  What the vehicle tells is read here, from the same bytes that
MAVSDK gets, because MAVSDK passes on neither the positions' time stamps nor mode numbers nor the estimator's
flags; and no acknowledgement is believed before it shows there.  MAVSDK's own view of the vehicle's health is
asked for before anything is armed.

MAVSDK repeats the last velocity 20 times a second until it is told another.  Only what is fresh is let through:
what nobody ordered any more is not sent, and the firmware notices that the controller is silent.
"""

import json
from typing import Any

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.messages import Timesync

from . import procedures
from .autopilots.ardupilot import climb_rate
from .backend import Begins, Wake
from .commands import AUTOPILOT_COMPONENT, Ask, Command, Several
from .link import Link
from .mavsdk_client import Answer, Client
from .mavsdk_deeds import deed_of
from .phases import STREAMING, Phase
from .preflight import Checks, Preflight
from .session import Session
from .settings import SessionSettings
from .steps import Step

SETPOINT: int = mav.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED
STEERED = (Phase.ENGAGED, *STREAMING)
FRESH_INTERVALS = 2.0
"""A setpoint that was ordered longer ago than so many intervals is not repeated any more."""


class MavsdkLink(Link):
    """The same link, with MAVSDK between it and the vehicle on the way out."""

    def __init__(self, system: int, client: Client) -> None:
        super().__init__(system)
        self.steered = False  #: whether setpoints may pass
        self._client = client

    def take(self, data: bytes) -> list[Frame]:
        """The same for MAVSDK and for the session."""
        self._client.feed(data)
        return super().take(data)

    def send_message(self, message: Any) -> None:
        """Have MAVSDK send a ping.  All else are replies in a fence transfer, which MAVSDK gives itself."""
        if isinstance(message, Timesync):
            self._client.send("TIMESYNC", json.dumps(message._asdict()), self.system, AUTOPILOT_COMPONENT)

    def send_heartbeat(self) -> None:
        """MAVSDK sends its own, one a second."""

    def outgoing(self) -> list[bytes]:
        """What MAVSDK wants sent, less the setpoints that are no longer wanted."""
        frames = [f for f in self._client.drain() if self.steered or _message_id(f) != SETPOINT]
        self._traffic += frames
        return frames


def _message_id(frame: bytes) -> int:
    """Of a MAVLink 2 frame."""
    return int.from_bytes(frame[7:10], "little")


class MavsdkSession(Session):
    """The controller's side of one vehicle, by way of MAVSDK."""

    def __init__(self, system: int, *, settings: SessionSettings, now: float, client: Client) -> None:
        super().__init__(system, settings=settings, now=now)
        self._client = client
        self._wire = MavsdkLink(system, client)
        self._link = self._wire
        self._checks = Checks(Preflight(), self._wire, self._settings)
        self._steered_at = float("-inf")
        self._fresh_s = FRESH_INTERVALS / (self._settings.setpoint_rate_hz * self._settings.time_scale)

    def poll(self, now: float) -> None:
        """Let time pass, after hearing what MAVSDK has to say."""
        self._now = now
        answers = self._client.answers()
        for answer in answers:
            self._hear(answer)
        if answers:
            self._advance()
        super().poll(now)

    def outgoing(self) -> list[bytes]:
        """Frames to send, one a datagram; setpoints only while they are ordered."""
        self._wire.steered = self.phase in STEERED and self._now - self._steered_at <= self._fresh_s
        return super().outgoing()

    def _hear(self, answer: Answer) -> None:
        """MAVSDK has done something, or could not."""
        step = self._procedure.step if self._procedure is not None else None
        command = step.command if step is not None else None
        if isinstance(command, Command) and command.name == answer.name and answer.result is not None:
            assert self._procedure is not None
            self._procedure.acknowledge(command.number, answer.result, self._now)

    def _read_ack(self, fields: Any) -> None:
        """Acknowledgements are MAVSDK's to read: it sends other commands than the steps name."""

    def _ask(self, ask: Ask, confirmation: int) -> None:
        if isinstance(ask, Several):
            for one in ask.asks:
                self._ask(one, confirmation)
            return
        steering = self.phase in STREAMING
        deed = deed_of(ask, self._known_adapter(), self.system, self._altitude_m, steering)
        self._client.do(ask.name, deed)

    def _send_setpoint(self, v_east: float, v_north: float, altitude_m: float) -> None:
        """A velocity; the altitude loop is closed here, for MAVSDK has no velocity at a height."""
        self._steered_at = self._now
        self._client.steer(v_north, v_east, -climb_rate(altitude_m - self.telemetry.height_m))

    def _locate(self) -> None:
        """MAVSDK knows the vehicle by now; a first ping, for it may be ready before the next one is due."""
        self._link.send_message(self._tally.ping(self._now))
        agrees = Step(
            "health by MAVSDK", self._settings.ready_patience_s, confirmed=lambda _: self._client.healthy
        )
        self._begin((*procedures.positioning(self._known_adapter(), self._settings), agrees))


class MavsdkBackend:
    """Makes such sessions, each with a MAVSDK to itself."""

    def __init__(self) -> None:
        self._clients: list[Client] = []

    def session(
        self, system: int, settings: SessionSettings, now: float, wake: Wake, begins: Begins
    ) -> Session:
        """The session of one vehicle, on the ground; MAVSDK signs nothing."""
        self._clients.append(Client(wake))
        return MavsdkSession(system, settings=settings, now=now, client=self._clients[-1])

    def close(self) -> None:
        """End every MAVSDK.  What they still wait for, they wait for together."""
        for client in self._clients:
            client.stop()
        for client in self._clients:
            client.close()
        self._clients.clear()
