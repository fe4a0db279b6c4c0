"""The parameter protocol: PARAM_REQUEST_READ, PARAM_REQUEST_LIST and PARAM_SET, and their answers."""

from typing import TYPE_CHECKING

from swarmctl.mavlink.codec import Frame
from swarmctl.mavlink.dialect import mav

from .parameters import Entry

if TYPE_CHECKING:
    from .vehicle import StubVehicle


def read(vehicle: "StubVehicle", frame: Frame) -> None:
    """PARAM_REQUEST_READ, by name or by index."""
    fields, parameters = frame.fields, vehicle.parameters
    index = fields.param_index
    name = fields.param_id if index < 0 else parameters.name_at(index)
    if name is None or name not in parameters:
        _tell_error(vehicle, frame, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST)
    else:
        tell_value(vehicle, parameters.entry(name))


def read_all(vehicle: "StubVehicle", frame: Frame) -> None:
    """PARAM_REQUEST_LIST."""
    for entry in vehicle.parameters:
        tell_value(vehicle, entry)


def write(vehicle: "StubVehicle", frame: Frame) -> None:
    """PARAM_SET: what the parameter is afterwards, or an error."""
    fields, parameters = frame.fields, vehicle.parameters
    name = fields.param_id
    if name not in parameters:
        _tell_error(vehicle, frame, mav.MAV_PARAM_ERROR_DOES_NOT_EXIST)
    elif not parameters.set_from_wire(name, fields.param_value, fields.param_type):
        _tell_error(vehicle, frame, mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
    else:
        vehicle.personality.parameter_changed(name)
        tell_value(vehicle, parameters.entry(name))


def tell_value(vehicle: "StubVehicle", entry: Entry) -> None:
    """Send a PARAM_VALUE."""
    vehicle.send_message(
        mav.MAVLink_param_value_message(
            entry.name.encode(), entry.wire_value, entry.wire_type, len(vehicle.parameters), entry.number
        )
    )


def _tell_error(vehicle: "StubVehicle", frame: Frame, error: int) -> None:
    """PARAM_ERROR from a firmware that knows it; silence from one that does not."""
    if not vehicle.personality.tells_parameter_errors:
        return
    fields = frame.fields
    index = getattr(fields, "param_index", -1)
    name = fields.param_id.encode("ascii", "replace")
    vehicle.send_message(mav.MAVLink_param_error_message(frame.system, frame.component, name, index, error))
