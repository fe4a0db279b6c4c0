"""Somebody on the line between a controller and a vehicle, over TCP: passes everything on, and adds frames of its own.

Now and then it adds an order, or a mode, that nobody gave: unsigned, signed with another key, and one that it has
heard before.
"""

import contextlib
import socket
import threading
from collections.abc import Callable

from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mavlink.dialect import mav
from swarmctl.mavlink.signing import Signing

EVERY = 100
RTL = {"px4": (4.0, 5.0), "ardupilot": (6.0, 0.0)}
RTL_SHOWN = {"px4": 0x05040000, "ardupilot": 6}


class Meddler:
    """Listens on ``port`` once, and speaks to the vehicle on ``vehicle_port``.

    ``to_controller``, ``to_vehicle``: how many frames of each kind were added.
    """

    def __init__(self, port: int, vehicle_port: int, autopilot: str) -> None:
        self.to_controller = self.to_vehicle = 0
        self._vehicle_port, self._autopilot = vehicle_port, autopilot
        self._forger = Signing(b"\7" * 32, lambda: 10**14)
        self._ends: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", port))
        threading.Thread(target=self._meet, daemon=True).start()

    def close(self) -> None:
        """Cut the line."""
        for end in (self._listener, *self._ends):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def _meet(self) -> None:
        with contextlib.suppress(OSError):
            controller, _ = self._listener.accept()
            vehicle = socket.create_connection(("127.0.0.1", self._vehicle_port))
            self._ends += [controller, vehicle]
            for source, sink, add in (
                (controller, vehicle, self._order),
                (vehicle, controller, self._pretend),
            ):
                threading.Thread(target=self._pass, args=(source, sink, add), daemon=True).start()

    def _pass(self, source: socket.socket, sink: socket.socket, add: Callable[[], bytes]) -> None:
        decoder, heard = Decoder(), list[bytes]()
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                for frame in decoder.feed(data):
                    sink.sendall(frame.raw)
                    heard.append(frame.raw)
                    if len(heard) % EVERY == 0:
                        lie = add()
                        sink.sendall(lie + self._forger.sign(lie, 0) + heard[len(heard) // 2])

    def _order(self) -> bytes:
        """Come home."""
        self.to_vehicle += 1
        mode = RTL[self._autopilot]
        return Encoder(255, 190).encode(
            mav.MAVLink_command_long_message(1, 1, mav.MAV_CMD_DO_SET_MODE, 0, 1.0, *mode, 0, 0, 0, 0)
        )

    def _pretend(self) -> bytes:
        """It comes home."""
        self.to_controller += 1
        autopilot = mav.MAV_AUTOPILOT_PX4 if self._autopilot == "px4" else mav.MAV_AUTOPILOT_ARDUPILOTMEGA
        return Encoder(1, 1).heartbeat(2, autopilot, 0x81, RTL_SHOWN[self._autopilot], 4)
