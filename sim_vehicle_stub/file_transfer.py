"""MAVLink FTP as a vehicle without files answers it: everything that a client asks for is refused, at once.

Ground stations try to fetch the parameters as a file before they ask for them one by one, and go on only
when they have an answer or have asked for a long time: 12 s MAVProxy.
"""

import struct
from typing import TYPE_CHECKING

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

if TYPE_CHECKING:
    from .vehicle import StubVehicle

HEADER = struct.Struct("<HBBBBBxI")
"""Sequence number, session, opcode, size of the data, opcode that is answered, burst complete, offset."""
PAYLOAD_BYTES = 251
SEQUENCE_NUMBERS = 1 << 16


def answer(vehicle: "StubVehicle", frame: Frame) -> None:
    """FILE_TRANSFER_PROTOCOL: there is no such file; but any session can be ended."""
    sequence, session, opcode, _, _, _, offset = HEADER.unpack_from(bytes(frame.fields.payload))
    ends = opcode in (mav.MAV_FTP_OPCODE_TERMINATESESSION, mav.MAV_FTP_OPCODE_RESETSESSION)
    result = mav.MAV_FTP_OPCODE_ACK if ends else mav.MAV_FTP_OPCODE_NAK
    data = b"" if ends else bytes([mav.MAV_FTP_ERR_FILENOTFOUND])
    header = HEADER.pack((sequence + 1) % SEQUENCE_NUMBERS, session, result, len(data), opcode, 0, offset)
    vehicle.send_message(
        mav.MAVLink_file_transfer_protocol_message(
            0, frame.system, frame.component, (header + data).ljust(PAYLOAD_BYTES, b"\0")
        )
    )
