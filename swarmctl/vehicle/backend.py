"""Who speaks to the vehicles: swarmctl itself, or a library that handles them on its behalf.

A backend makes the sessions of a live flight.  The one by way of MAVSDK is ``mavsdk_session.MavsdkBackend``; it
is imported only when it is wanted, because MAVSDK need not be installed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from swarmctl.mavlink.signing import Signing

from .preflight import Preflight
from .session import Session
from .settings import SessionSettings

Wake = Callable[[], None]
"""To be called, from any thread, when a session has something to send or to do."""


@dataclass(frozen=True)
class Begins:
    """How a session begins.

    ``preflight`` from the start on; ``signing`` what it sends and believes; ``adopts``: a vehicle that is in the air
    already.
    """

    preflight: Preflight | None = None
    signing: Signing | None = None
    adopts: bool = False


class Backend(Protocol):
    """Makes sessions, and holds what they need until it is closed."""

    def session(
        self, system: int, settings: SessionSettings, now: float, wake: Wake, begins: Begins
    ) -> Session:
        """The session of one vehicle."""

    def close(self) -> None:
        """No session is used any more."""


class Mavlink:
    """swarmctl's own sessions, which do nothing by themselves."""

    def session(
        self, system: int, settings: SessionSettings, now: float, wake: Wake, begins: Begins
    ) -> Session:
        """The session of one vehicle."""
        return Session(
            system, settings=settings, now=now, preflight=begins.preflight, signing=begins.signing,
            adopts=begins.adopts,
        )  # fmt: skip

    def close(self) -> None:
        """There is nothing to close."""
