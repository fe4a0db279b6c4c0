"""The one place that imports the MAVLink dialect: constants, enums and message classes, MAVLink 2.

The dialect module is imported directly, never through ``mavutil``, which speaks MAVLink 1 unless an
environment variable says otherwise.  It has no usable type information, so it is passed on as ``Any``.
"""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega

mav: Any = ardupilotmega
