"""The steps of each phase, for any firmware: what its adapter says, in the order that all share.

Nothing that telemetry can show is taken on the word of a COMMAND_ACK; message rates are the exception, and
``positioning`` finds out whether those messages really come.
"""

from swarmctl.mavlink.dialect import mav

from .autopilots.adapter import Adapter
from .commands import Several, disarm, message_interval, request_message
from .settings import SessionSettings
from .steps import Condition, OnFailure, Step
from .telemetry import Telemetry

ON_GROUND: int = mav.MAV_LANDED_STATE_ON_GROUND
IN_AIR: int = mav.MAV_LANDED_STATE_IN_AIR
LANDING: int = mav.MAV_LANDED_STATE_LANDING
LET_LAND_M = 5.0
"""One that was lower when it was found landing is let land."""

Steps = tuple[Step, ...]


def wanted_rates(adapter: Adapter, settings: SessionSettings) -> dict[int, float]:
    """Message id → Hz of what the session and its adapter read, besides HEARTBEAT."""
    return {
        mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: settings.rate_hz,
        mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: settings.status_rate_hz,
        mav.MAVLINK_MSG_ID_SYS_STATUS: settings.status_rate_hz,
        **adapter.extra_rates,
    }


def identifying(settings: SessionSettings) -> Steps:
    """The firmware's version, if it says."""
    return (
        Step(
            "version",
            settings.command_patience_s,
            command=request_message(mav.MAVLINK_MSG_ID_AUTOPILOT_VERSION),
            confirmed=lambda t: t.version is not None,
            on_failure=OnFailure.WARN,
        ),
    )


def configuring(adapter: Adapter, settings: SessionSettings) -> Steps:
    """The rates of what is read; off with what is not: a firmware refuses that for messages it lacks."""
    patience = settings.command_patience_s
    unwanted = [
        Step("message rates", patience, command=message_interval(i, 0.0), on_failure=OnFailure.IGNORE)
        for i in adapter.unwanted_messages
    ]
    return (*_rates(adapter, settings, OnFailure.FAIL), *unwanted)


def _rates(adapter: Adapter, settings: SessionSettings, on_failure: OnFailure) -> Steps:
    """Ask for the rates of what is read; where they are needed, for as long as patience lasts."""
    patience, needed = settings.command_patience_s, on_failure is OnFailure.FAIL
    return tuple(
        Step(
            "message rates", patience, command=message_interval(i, hz), insists=needed, on_failure=on_failure
        )
        for i, hz in wanted_rates(adapter, settings).items()
    )


def positioning(adapter: Adapter, settings: SessionSettings) -> Steps:
    """Every message that flight needs has come, and the vehicle stands on the ground, ready to arm."""
    return (
        *_messages(adapter, settings, _stands),
        *adapter.prepare(settings),
        _gate(adapter, settings),
    )


def finding(adapter: Adapter, settings: SessionSettings) -> Steps:
    """The same of a vehicle that another controller took off: it flies, or has landed, and nothing is changed.

    One that is about to touch down is let land.
    """
    return _messages(adapter, settings, flies_on_or_has_landed)


def _messages(adapter: Adapter, settings: SessionSettings, standing: Condition) -> Steps:
    """Every message that flight needs has come; ``standing``: what the vehicle has to say of the ground."""
    patience = settings.ready_patience_s
    rates = wanted_rates(adapter, settings)
    origin = _requested(
        "origin", mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, patience, lambda t: t.origin is not None
    )

    def streamed(name: str, message_id: int, confirmed: Condition) -> Step:
        """A message that should come by itself; its rate is asked for again when it does not."""
        command = message_interval(message_id, rates[message_id])
        wait = settings.confirm_timeout_s
        return Step(name, patience, command=command, confirmed=confirmed, wait_s=wait, insists=True)

    return (
        streamed("position", mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, lambda t: t.positioned),
        streamed("standing", mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, standing),
        streamed("system status", mav.MAVLINK_MSG_ID_SYS_STATUS, lambda t: t.status_received),
        *((origin,) if adapter.needs_origin else ()),
        _requested("home", mav.MAVLINK_MSG_ID_HOME_POSITION, patience, lambda t: t.home is not None),
    )


def flies_on_or_has_landed(t: Telemetry) -> bool:
    """Not on the last metres of a landing, nor on the ground with motors that still run."""
    low = t.landed_state == LANDING and t.height_m < LET_LAND_M
    return t.landed_state != 0 and (not t.armed or not (low or t.landed_state == ON_GROUND))


def _gate(adapter: Adapter, settings: SessionSettings) -> Step:
    """Ready to arm; the rates are asked for again now and then, for a reboot may have been missed."""
    asks = tuple(message_interval(i, hz) for i, hz in wanted_rates(adapter, settings).items())
    pause = settings.reminder_s
    return Step(
        "ready to arm", settings.ready_patience_s, command=Several("message rates", asks),
        confirmed=lambda t: t.healthy and not t.armed, wait_s=pause, answer_s=pause, insists=True,
    )  # fmt: skip


def _stands(telemetry: Telemetry) -> bool:
    """On the ground, by the vehicle's own word."""
    return telemetry.landed_state == ON_GROUND


def _requested(name: str, message_id: int, patience_s: float, confirmed: Condition) -> Step:
    """A message that comes when asked for, but only once the vehicle knows its content."""
    return Step(name, patience_s, command=request_message(message_id), confirmed=confirmed, insists=True)


def taking_off(adapter: Adapter, telemetry: Telemetry, altitude_m: float, settings: SessionSettings) -> Steps:
    """The firmware's own order, then the climb.

    The climb is judged by altitude above sea level: home, and with it the height above home, may be set
    anew when the vehicle is armed.  Raises ``ValueError`` while the home position is unknown.
    """
    if telemetry.home is None:
        raise ValueError("take-off needs the home position")
    altitude_amsl_m = telemetry.home.alt_amsl_m + altitude_m

    def reached(t: Telemetry) -> bool:
        return (
            t.landed_state == IN_AIR
            and abs(t.altitude_amsl_m - altitude_amsl_m) <= settings.altitude_tolerance_m
            and abs(t.v_up) <= settings.climb_tolerance_mps
        )

    climb_s = altitude_m / settings.slowest_climb_mps / settings.time_scale
    modes = frozenset((adapter.modes.take_off, adapter.modes.hold))
    climb = Step("take-off altitude", settings.climb_patience_s + climb_s, confirmed=reached, modes=modes)
    return (*adapter.take_off(telemetry, altitude_m, settings), climb)


def engaging(adapter: Adapter, settings: SessionSettings, ours: frozenset[int] | None) -> Steps:
    """Hold setpoints flow for a while, then the mode is changed.

    ``ours``: the modes from which that is meant; None is any, whoever chose it.
    """
    modes = adapter.modes
    return (
        Step("setpoint stream", settings.command_patience_s, wait_s=settings.stream_s, modes=ours),
        Step(
            "offboard control",
            settings.command_patience_s,
            command=adapter.set_mode(modes.engaged),
            confirmed=lambda t: t.mode == modes.engaged,
            modes=ours,
        ),
    )


def stopping(adapter: Adapter, settings: SessionSettings) -> Steps:
    """The firmware's own hold; hold setpoints flow until it is in that mode."""
    modes = adapter.modes
    return (
        Step(
            "hold mode",
            settings.command_patience_s,
            command=adapter.set_mode(modes.hold),
            confirmed=lambda t: t.mode == modes.hold,
            modes=frozenset((modes.take_off, modes.hold, modes.engaged)),
            insists=True,
        ),
    )


def landing(adapter: Adapter, telemetry: Telemetry, settings: SessionSettings, ask_rates: bool) -> Steps:
    """Land here, disarm if the firmware does not, and leave a mode from which arming is harmless.

    On disarming, PX4 falls back to an earlier mode; were that offboard, a vehicle that is armed while
    setpoints flow would fly.  The land mode is asked for even of a vehicle that stands disarmed: an ARM may
    still be on its way.  ``ask_rates``: the vehicle may have forgotten which messages we want.
    """
    modes = adapter.modes
    patience = settings.command_patience_s
    descent_s = max(telemetry.height_m, 0.0) / settings.slowest_descent_mps / settings.time_scale
    return (
        Step(
            "land mode",
            settings.landing_patience_s,
            command=adapter.set_mode(modes.land),
            confirmed=lambda t: t.mode == modes.land,
            insists=True,
        ),
        *(_rates(adapter, settings, OnFailure.IGNORE) if ask_rates else ()),
        Step(
            "touch-down",
            settings.landing_patience_s + descent_s,
            confirmed=_stands,
            modes=frozenset((modes.land,)),
        ),
        Step(
            "disarming",
            patience,
            command=disarm(),
            confirmed=lambda t: not t.armed,
            wait_s=settings.disarm_after_s,
            insists=True,
        ),
        Step(
            "parked",
            patience,
            command=adapter.set_mode(modes.parked),
            confirmed=lambda t: t.mode == modes.parked,
            on_failure=OnFailure.WARN,
        ),
    )
