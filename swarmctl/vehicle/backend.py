"""Who speaks to the vehicles: swarmctl itself, or a library that handles them on its behalf.

A backend makes the sessions of a live flight.  The one by way of MAVSDK is ``mavsdk_session.MavsdkBackend``; it
is imported only when it is wanted, because MAVSDK need not be installed.
"""

from collections.abc import Callable
from typing import Protocol

from .session import Session
from .settings import SessionSettings

Wake = Callable[[], None]
"""To be called, from any thread, when a session has something to send or to do."""


class Backend(Protocol):
    """Makes sessions, and holds what they need until it is closed."""

    def session(self, system: int, settings: SessionSettings, now: float, wake: Wake) -> Session:
        """The session of one vehicle."""

    def close(self) -> None:
        """No session is used any more."""


class Mavlink:
    """swarmctl's own sessions, which do nothing by themselves."""

    def session(self, system: int, settings: SessionSettings, now: float, wake: Wake) -> Session:
        """The session of one vehicle."""
        return Session(system, settings=settings, now=now)

    def close(self) -> None:
        """There is nothing to close."""
