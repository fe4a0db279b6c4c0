"""The one place that imports the MAVLink dialect: constants, enums and message classes, MAVLink 2.

The dialect module is imported directly, never through ``mavutil``, which speaks MAVLink 1 unless an
environment variable says otherwise.  It has no usable type information, so it is passed on as ``Any``.
"""

import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega

mav: Any = ardupilotmega


class CurrentMode(mav.MAVLink_message):  # type: ignore[misc]
    """CURRENT_MODE, which PX4 sends and this dialect lacks; made as pymavlink makes its messages."""

    id = 436
    msgname = "CURRENT_MODE"
    fieldnames = ("standard_mode", "custom_mode", "intended_custom_mode")
    ordered_fieldnames = ("custom_mode", "intended_custom_mode", "standard_mode")
    orders = (2, 0, 1)
    fieldtypes = ("uint8_t", "uint32_t", "uint32_t")
    lengths, array_lengths = (1, 1, 1), (0, 0, 0)
    crc_extra = 193
    unpacker = struct.Struct("<IIB")
    instance_field = None

    def __init__(self, standard_mode: int, custom_mode: int, intended_custom_mode: int) -> None:
        super().__init__(self.id, self.msgname)
        self._fieldnames = self.fieldnames
        self.standard_mode = standard_mode
        self.custom_mode = custom_mode
        self.intended_custom_mode = intended_custom_mode

    def pack(self, packer: Any, force_mavlink1: bool = False) -> bytes:
        """The frame, by the packer of one component."""
        payload = self.unpacker.pack(self.custom_mode, self.intended_custom_mode, self.standard_mode)
        frame: bytes = self._pack(packer, self.crc_extra, payload, force_mavlink1=force_mavlink1)
        return frame


CURRENT_MODE: int = CurrentMode.id
mav.mavlink_map[CURRENT_MODE] = CurrentMode
