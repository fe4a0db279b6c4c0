"""What a session may be told: rates, time-outs and tolerances, each with its unit.

Durations are in the vehicle's time.  A simulator that runs at ``time_scale`` times real time is given
correspondingly less of the caller's clock: ``on_clock`` converts once, so that deadlines stay exact.
"""

import math
from dataclasses import dataclass, fields, replace


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """Settings of one vehicle's session; the defaults suit a vehicle on a LAN or a stub in memory.

    Raises ``ValueError``, naming the setting, for a value that is not positive and finite.
    """

    time_scale: float = 1.0  #: vehicle seconds per second of the caller's clock
    rate_hz: float = 10.0  #: GLOBAL_POSITION_INT asked of the vehicle
    status_rate_hz: float = 2.0  #: SYS_STATUS and EXTENDED_SYS_STATE asked of the vehicle
    setpoint_rate_hz: float = 10.0  #: hold setpoints while offboard mode is being entered

    heartbeat_period_s: float = 1.0  #: our own HEARTBEAT
    link_loss_s: float = 3.0  #: of silence, or thrice that without HEARTBEAT: the link counts as lost
    deaf_s: float = 15.0  #: without an answer to a ping, of a vehicle that did answer: it hears nothing
    ack_timeout_s: float = 0.5  #: a command without COMMAND_ACK is sent again
    attempts: int = 12  #: unanswered sendings of one command until the session gives up
    confirm_timeout_s: float = 2.5  #: an accepted command that telemetry does not confirm is sent again
    retry_pause_s: float = 1.0  #: before a temporarily rejected command is sent again
    astray_s: float = 10.0  #: the contrary of setpoints flown for so long is reported
    position_loss_s: float = 2.0  #: heartbeats without a valid position for so long: the position is lost
    battery_low_percent: float | None = None  #: at or below it, the battery is reported as low; None: never

    set_up_attempts: int = 6  #: set-ups broken off by a lost link or a restart until the session gives up
    reminder_s: float = 10.0  #: while a vehicle gets ready, what tells so is asked for again this often
    ready_patience_s: float = 90.0  #: for each of position, home, origin and health before take-off
    command_patience_s: float = 20.0  #: for a command to be accepted and confirmed by telemetry
    parameter_patience_s: float = 6.0  #: for each parameter; unknown ones may go without any answer
    transfer_timeout_s: float = 5.0  #: a fence transfer that stands still for so long begins again
    climb_patience_s: float = 30.0  #: for take-off, besides the climb at ``slowest_climb_mps``
    slowest_climb_mps: float = 0.5
    landing_patience_s: float = 60.0  #: for the landing, besides the descent at ``slowest_descent_mps``
    slowest_descent_mps: float = 0.25
    stream_s: float = 0.5  #: of hold setpoints before offboard mode is asked for
    disarm_after_s: float = 5.0  #: on the ground; then the vehicle is told to disarm

    altitude_tolerance_m: float = 0.5  #: take-off is over within this of its altitude
    climb_tolerance_mps: float = 0.3  #: and slower than this
    disarm_height_m: float = 3.0  #: above home; disarmed there while sinking, a landing has failed

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ValueError(f"session setting {field.name} must be positive and finite, not {value}")

    def on_clock(self) -> "SessionSettings":
        """The same settings with every duration in seconds of the caller's clock."""
        durations = {f.name: getattr(self, f.name) for f in fields(self) if f.name.endswith("_s")}
        return replace(self, **{name: value / self.time_scale for name, value in durations.items()})
