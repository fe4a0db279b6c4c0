"""Giving vehicles a signing key over the link, or taking it away, and seeing that they took it.

SETUP_SIGNING carries the key in the clear, and no answer belongs to it: what shows that a vehicle took it is how
its next frames are signed.  The message itself is signed with the key, which a vehicle without one does not mind
and one that has it demands.
"""

import asyncio
from collections.abc import Callable, Sequence

from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import KEY_BYTES, Signing, Verdict, Verifier
from swarmctl.vehicle.addresses import Address
from swarmctl.vehicle.commands import AUTOPILOT_COMPONENT
from swarmctl.vehicle.link import GROUND_COMPONENT, GROUND_SYSTEM
from swarmctl.vehicle.switchboard import Switchboard
from swarmctl.vehicle.transports import TransportError

from .errors import RefusedError
from .live import CALLING_LINK

LISTEN_S = 3.0
"""Heartbeats come once a second."""
ASK_S, TRIES = 1.5, 4


class KeyGiver:
    """Wires to vehicles, and what was last heard of each one's signature."""

    def __init__(self, signing: Signing) -> None:
        self._signing = signing
        self._board = Switchboard()
        self._board.subscribe(self._arrived)
        self._verifier = Verifier(signing)
        self._encoder = Encoder(GROUND_SYSTEM, GROUND_COMPONENT)
        self._last: dict[int, Verdict] = {}

    async def find(self, addresses: Sequence[Address], timeout_s: float) -> list[int]:
        """Open the addresses and listen; the system ids of all vehicles there.  Raises RefusedError for none."""
        try:
            await self._board.open(list(addresses))
        except TransportError as error:
            raise RefusedError(str(error)) from None
        await self._call_until(lambda: bool(self._board.heard), timeout_s)
        await self._call_until(lambda: False, LISTEN_S)
        if not self._board.heard:
            raise RefusedError(f"no vehicle was heard within {timeout_s:g} s")
        return self._board.heard

    async def give(self, key: bytes | None) -> dict[int, bool]:
        """Give every vehicle the key, or take it away; whether each now does as it was told."""
        secret, time = (key, self._signing.now) if key else (bytes(KEY_BYTES), 0)
        self._last.clear()
        for _ in range(TRIES):
            for system in self._left(key):
                message = mav.MAVLink_setup_signing_message(system, AUTOPILOT_COMPONENT, list(secret), time)
                self._board.send(system, self._signed(self._encoder.encode(message)))
            await self._call_until(lambda: not self._left(key), ASK_S)
        return {system: system not in self._left(key) for system in self._board.heard}

    def close(self) -> None:
        """Close every wire."""
        self._board.close()

    def _left(self, key: bytes | None) -> list[int]:
        """Those whose last frame does not show that they did as they were told."""
        wanted = (Verdict.GOOD, Verdict.REPLAYED) if key else (Verdict.UNSIGNED,)
        return [system for system in self._board.heard if self._last.get(system) not in wanted]

    async def _call_until(self, met: Callable[[], bool], limit_s: float) -> None:
        loop = asyncio.get_running_loop()
        end = loop.time() + limit_s
        while not met() and loop.time() < end:
            beat = self._encoder.heartbeat(mav.MAV_TYPE_GCS, mav.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            self._board.call(self._signed(beat))
            await asyncio.sleep(0.2)

    def _signed(self, frame: bytes) -> bytes:
        return self._signing.sign(frame, CALLING_LINK)

    def _arrived(self, system: int, data: bytes) -> None:
        for frame in Decoder().feed(data):
            if frame.component == AUTOPILOT_COMPONENT:
                self._last[system] = self._verifier.judge(frame.raw)
