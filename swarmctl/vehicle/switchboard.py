"""The switchboard: which vehicle is behind which wire and address.

One port may carry many vehicles and several ports one each; what tells them apart is the system id in every
frame.  A datagram goes to its vehicle as it came; a stream is cut into frames first.  Each vehicle is
answered at the address that it last sent from.

With a signing key only a signed frame makes a vehicle known, or moves the address that it is answered at.  The
sessions judge for themselves what they take in, and count what they do not, so they are handed everything.  A
vehicle whose clock is behind signs with a time that is long past, until it hears a newer one: it is called where
it sends from, and nothing more, until then.
"""

from collections import Counter
from collections.abc import Callable

from swarmctl.mavlink.codec import Decoder, Frame
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import Signing, Verdict, Verifier

from .addresses import Address
from .transports import Peer, Wire, open_wire

AUTOPILOT_COMPONENT: int = mav.MAV_COMP_ID_AUTOPILOT1
HEARTBEAT: int = mav.MAVLINK_MSG_ID_HEARTBEAT
NOT_VEHICLES = (mav.MAV_TYPE_GCS, mav.MAV_TYPE_ONBOARD_CONTROLLER, mav.MAV_TYPE_GIMBAL, mav.MAV_TYPE_ADSB)
STREAMS = ("tcp", "serial")
MOST_BEHIND = 256
Deliver = Callable[[int, bytes], None]


class Switchboard:
    """Open wires, and the way to each vehicle that was heard on them.

    ``deliver(system, data)`` is called with bytes of each vehicle that somebody asked for by `subscribe`.
    ``strangers``: how many frames of which system id were dropped on which verdict, if there is a key.
    """

    def __init__(self, signing: Signing | None = None) -> None:
        self.strangers: Counter[tuple[int, Verdict]] = Counter()
        self._verifier = Verifier(signing) if signing else None
        self._behind: dict[tuple[int, Peer], Wire] = {}
        self._wires: list[Wire] = []
        self._decoders: dict[int, Decoder] = {}
        self._ways: dict[int, tuple[Wire, Peer]] = {}
        self._heard: set[int] = set()
        self._deliver: Deliver | None = None

    @property
    def heard(self) -> list[int]:
        """System ids of the vehicles whose heartbeat came, ascending."""
        return sorted(self._heard)

    async def open(self, addresses: list[Address]) -> None:
        """Open all addresses.  Raises TransportError; those already open are closed then."""
        try:
            for address in addresses:
                self._wires.append(await open_wire(address, self._arrived))
        except BaseException:
            self.close()
            raise

    def subscribe(self, deliver: Deliver) -> None:
        """Have the vehicles' bytes handed on from now on."""
        self._deliver = deliver

    def way(self, system: int) -> str:
        """Where a vehicle is, for people."""
        wire, peer = self._ways[system]
        return f"{wire.address}" + (f" from {peer[0]}:{peer[1]}" if peer else "")

    def complaint(self) -> str:
        """What was dropped for its signature so far, for people; nothing without a key."""
        dropped = [
            f"system {system}: {count} {v.value}"
            for (system, v), count in sorted(
                self.strangers.items(), key=lambda item: (item[0][0], item[0][1].value)
            )
        ]
        return f"; frames dropped for their signature: {', '.join(dropped)}" if dropped else ""

    def address(self, system: int) -> Address:
        """The address that a vehicle was heard on."""
        return self._ways[system][0].address

    def send(self, system: int, frame: bytes) -> None:
        """Send a frame to a vehicle; one that was never heard is sent nothing."""
        way = self._ways.get(system)
        if way is not None:
            way[0].send(frame, way[1])

    def call(self, frame: bytes) -> None:
        """Send a frame on every wire: what waits to be spoken to (udpout, serial) then answers."""
        for wire in self._wires:
            wire.send(frame, None)
        for (_, peer), wire in self._behind.items():
            wire.send(frame, peer)

    def close(self) -> None:
        """Close every wire."""
        for wire in self._wires:
            wire.close()
        self._wires.clear()

    def _arrived(self, wire: Wire, data: bytes, peer: Peer) -> None:
        if wire.address.kind in STREAMS:
            for frame in self._decoders.setdefault(id(wire), Decoder()).feed(data):
                self._take(wire, frame, peer)
            return
        system = _sender(data)
        if system is None:
            return
        if self._verifier is not None:
            for frame in Decoder().feed(data):
                self._take(wire, frame, peer)
            return
        if system not in self._heard:
            for frame in Decoder().feed(data):
                self._note(frame)
        self._hand_on(wire, system, data, peer)

    def _take(self, wire: Wire, frame: Frame, peer: Peer) -> None:
        """One frame: who sends it and where from is believed only if it is signed, where there is a key."""
        verdict = self._verifier.judge(frame.raw) if self._verifier else Verdict.GOOD
        if verdict is Verdict.GOOD:
            self._note(frame)
            self._ways[frame.system] = (wire, peer)
        else:
            self.strangers[frame.system, verdict] += 1
            if verdict is Verdict.REPLAYED and peer is not None and len(self._behind) < MOST_BEHIND:
                self._behind[id(wire), peer] = wire
        if self._deliver is not None:
            self._deliver(frame.system, frame.raw)

    def _note(self, frame: Frame) -> None:
        """A vehicle is what sends heartbeats as an autopilot."""
        beats = frame.message_id == HEARTBEAT and frame.component == AUTOPILOT_COMPONENT
        if beats and frame.fields.type not in NOT_VEHICLES:
            self._heard.add(frame.system)

    def _hand_on(self, wire: Wire, system: int, data: bytes, peer: Peer) -> None:
        self._ways[system] = (wire, peer)
        if self._deliver is not None:
            self._deliver(system, data)


def _sender(data: bytes) -> int | None:
    """The system id of the first frame of a datagram, MAVLink 2 or 1."""
    if len(data) > 5 and data[0] == 0xFD:
        return data[5]
    if len(data) > 3 and data[0] == 0xFE:
        return data[3]
    return None
