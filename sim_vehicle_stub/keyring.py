"""A vehicle's signing key: with one, all that it sends is signed, and what is not is dropped and counted.

The key comes with the fleet, or over the link by SETUP_SIGNING where the firmware takes it (ArduPilot, disarmed);
it outlasts reboots, what was heard from whom does not.  The vehicle's clock is the fleet's time from a date on.
"""

from collections import Counter
from typing import TYPE_CHECKING

from swarmctl.mavlink.codec import Decoder, Frame
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import REFUSED, UNITS_PER_S, SignedDecoder, Signing, Verdict, Verifier, units

if TYPE_CHECKING:
    from .vehicle import StubVehicle

LINK = 0
AHEAD = 60 * UNITS_PER_S
"""ArduPilot signs from a minute after the time that came with the key."""


class Keyring:
    """The key of one vehicle, if it has one.  ``date_s``: seconds since 1970 at the fleet's time zero."""

    def __init__(self, vehicle: "StubVehicle", key: bytes | None, date_s: float) -> None:
        self._vehicle = vehicle
        self._date_s = date_s
        self._signing: Signing | None = None
        self._verifier: Verifier | None = None
        self._refused: Counter[Verdict] = Counter()
        if key is not None:
            self._take(key, 0)

    @property
    def refused(self) -> dict[Verdict, int]:
        """How many frames were dropped for which reason, since the vehicle was made."""
        now = self._verifier.counts if self._verifier else Counter()
        return {verdict: self._refused[verdict] + now[verdict] for verdict in REFUSED}

    def decoder(self) -> Decoder:
        """A decoder that starts anew, and with a key believes only what is signed."""
        if self._verifier is not None:
            self._refused.update(self._verifier.counts)
        self._verifier = Verifier(self._signing) if self._signing else None
        return SignedDecoder(self._verifier) if self._verifier else Decoder()

    def signed(self, frames: list[bytes]) -> list[bytes]:
        """The frames as they leave."""
        signing = self._signing
        return frames if signing is None else [signing.sign(frame, LINK) for frame in frames]

    def set_up(self, frame: Frame) -> None:
        """SETUP_SIGNING: a key, or none if all is zero."""
        vehicle, fields = self._vehicle, frame.fields
        if not vehicle.personality.TAKES_KEYS:
            return
        if vehicle.armed:
            vehicle.say(mav.MAV_SEVERITY_WARNING, "ERROR: Won't setup signing when armed")
            return
        key = bytes(fields.secret_key)
        if any(key) or fields.initial_timestamp:
            self._take(key, fields.initial_timestamp + AHEAD)
        else:
            self._signing = None
        vehicle.listen_with(self.decoder())

    def _take(self, key: bytes, newest: int) -> None:
        self._signing = Signing(key, lambda: units(self._date_s + self._vehicle.now), newest)
