"""What is looked at before a vehicle may be armed: the vehicle as it tells of itself, against the mission.

Each thing looked at is a `Finding`.  One that refuses keeps the vehicle on the ground; one with trouble alone
is told to the operator, who decides.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from swarmctl.core import calls
from swarmctl.core.arrays import Floats
from swarmctl.mission.geometry import Regions, regions
from swarmctl.mission.model import Mission, Vehicle
from swarmctl.mission.pads import launch_pads
from swarmctl.vehicle.fence import Circle, Fence
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session

STANDING_M = 5.0
"""A vehicle must stand within so much of the place where the mission expects it, and of its own home."""
HOME_HEIGHT_M = 3.0
"""Heights are told above home: it must lie within so much of the ground that the vehicle stands on."""
MOST_ROUND_TRIP_S = 2.5
"""A link slower than this cannot be flown over: the guard looks about three seconds ahead."""
CEILING_KEPT_M = 3.0
"""So far a vehicle stays below a ceiling of its own."""
LEAST_ALTITUDE_M = 5.0
"""A mission lowered to less is flown into bushes."""
LEAST_SETPOINTS = 3
"""A firmware must wait for so many missed setpoints before it takes its controller for lost."""
LEVEL_M = 3.0
"""Homes further apart in altitude than this make height layers of 6 m unsure."""
UNKNOWN = "?"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at: what it is, what was found, and what is wrong with that, if anything."""

    item: str
    value: str
    trouble: str = ""
    refuses: bool = False


class Inspection:
    """Inspects the vehicles of one mission, session i being its vehicle i.

    ``adapt``: a vehicle that cannot do what the mission asks is not refused, but flown as it can.
    """

    def __init__(self, mission: Mission, sessions: Sequence[Session], adapt: bool = False) -> None:
        self._mission, self._sessions, self._adapt = mission, sessions, adapt
        self._regions: Regions = regions(mission)
        self._pads = launch_pads(mission)
        shapely.prepare(self._regions.legal)

    def fence(self) -> Fence:
        """The mission's border and keep-outs as the vehicles' own geofence."""
        r = self._regions
        rings, circles = [], []
        for shape, ring in zip(self._mission.keep_out, r.keep_outs, strict=True):
            if shape.circle_m is None:
                rings.append(self._degrees(ring))
            else:
                ((lat, lon),) = self._degrees(np.array([shape.circle_m.center_m]))
                circles.append(Circle(lat, lon, shape.circle_m.radius_m))
        return Fence([self._degrees(r.border)], rings, circles)

    def _degrees(self, ring: Floats) -> list[tuple[float, float]]:
        o = self._mission.origin
        return [calls.to_geodetic(east, north, o.lat, o.lon, o.alt_m)[:2] for east, north in ring.tolist()]

    def vehicle(self, i: int) -> list[Finding]:
        """Everything about vehicle i."""
        session, wanted = self._sessions[i], self._mission.fleet[i]
        if session.adapter is None:
            return [Finding("autopilot", UNKNOWN, session.reason or "was not heard", True)]
        return [
            _autopilot(session, wanted),
            _health(session),
            _link(session),
            _battery(session, self._mission.safety.battery_return_percent),
            _home(session),
            self._place(i),
            self._level(i),
            self._speed(session, wanted),
            self._bounds(i),
            _fence(session),
            _failsafe(session, self._mission.setpoints.rate_hz),
        ]

    def _speed(self, session: Session, wanted: Vehicle) -> Finding:
        limit = session.parameters.get("speed_mps")
        if limit is None:
            return Finding("speed", UNKNOWN, "its speed limit cannot be read")
        if limit >= wanted.speed_mps - 1e-6:
            return Finding("speed", f"{limit:g} m/s")
        return self._less(
            "speed",
            f"{limit:g} m/s",
            f"it flies at most {limit:g} m/s, not the mission's {wanted.speed_mps:g}",
        )

    def _bounds(self, i: int) -> Finding:
        """The vehicle's own ceiling, and its circle about home, either of which would end its flight."""
        own = self._sessions[i].protection
        up, out = own.ceiling_m, own.radius_m
        limits = (f"{m:g} m {way}" for m, way in ((up, "up"), (out, "out")) if m is not None)
        value = ", ".join(limits) or "none"
        farthest, wanted = self._farthest(i), self._mission.fleet[i].altitude_m
        if out is not None and farthest > out:
            trouble = f"its own fence ends {out:g} m from home; the mission's area reaches {farthest:.0f} m"
            return Finding("bounds", value, trouble, True)
        if up is not None and wanted > up - CEILING_KEPT_M:
            trouble = f"its own fence ends {up:g} m above home; the mission flies at {wanted:g} m"
            return self._less("bounds", value, trouble, possible=up - CEILING_KEPT_M >= LEAST_ALTITUDE_M)
        return Finding("bounds", value)

    def _farthest(self, i: int) -> float:
        """The way (m) from where it stands to the farthest corner of the area."""
        if not self._sessions[i].telemetry.positioned:
            return 0.0
        corners = self._regions.border - np.array(place_en(self._mission, self._sessions[i]))
        return float(np.hypot(corners[:, 0], corners[:, 1]).max())

    def _less(self, item: str, value: str, trouble: str, possible: bool = True) -> Finding:
        """It can do less than the mission asks: refused, or flown as it can."""
        if self._adapt and possible:
            return Finding(item, value, f"{trouble}: adapted")
        return Finding(item, value, f"{trouble}{' (--adapt flies it as it can)' if possible else ''}", True)

    def _place(self, i: int) -> Finding:
        """Where it stands, against its pad, or, as found, against the area and the others."""
        if not self._sessions[i].telemetry.positioned:
            return Finding("place", UNKNOWN, "it does not say where it stands", True)
        east, north = stand = place_en(self._mission, self._sessions[i])
        value = f"{east:.0f} m E, {north:.0f} m N"
        if self._pads is not None:
            off = math.dist(stand, self._pads[i])
            trouble = f"it stands {off:.0f} m from its launch place (check the mission's origin and launch)"
            return Finding("place", value, trouble if off > STANDING_M else "", off > STANDING_M)
        if not shapely.intersects_xy(self._regions.legal, east, north):
            trouble = "it stands outside the area, inside a keep-out, or nearer than the margin to either"
            return Finding("place", value, trouble, True)
        return Finding("place", value, self._too_near(i, stand), bool(self._too_near(i, stand)))

    def _too_near(self, i: int, stand: tuple[float, float]) -> str:
        separation = self._mission.safety.separation_m
        for other in self._sessions:
            if other is self._sessions[i] or not other.telemetry.positioned:
                continue
            apart = math.dist(stand, place_en(self._mission, other))
            if apart < separation:
                return f"it stands {apart:.1f} m from vehicle {other.system}; separation_m is {separation:g}"
        return ""

    def _level(self, i: int) -> Finding:
        """Its home's altitude, against the others': heights are told above home."""
        homes = [s.telemetry.home for s in self._sessions]
        own = homes[i]
        if own is None:
            return Finding("altitude", UNKNOWN)
        middle = float(np.median([home.alt_amsl_m for home in homes if home is not None]))
        off = own.alt_amsl_m - middle
        trouble = (
            f"its home is {abs(off):.1f} m {'above' if off > 0 else 'below'} most others'"
            if abs(off) > LEVEL_M
            else ""
        )
        return Finding("altitude", f"{own.alt_amsl_m:.1f} m", trouble)


def place_en(mission: Mission, session: Session) -> tuple[float, float]:
    """Where a vehicle says it is, metres east and north of the mission's origin."""
    t, o = session.telemetry, mission.origin
    east, north = calls.to_local(t.lat_e7 * 1e-7, t.lon_e7 * 1e-7, o.lat, o.lon, o.alt_m)
    return float(east), float(north)


def _autopilot(session: Session, wanted: Vehicle) -> Finding:
    assert session.adapter is not None
    name = session.adapter.name
    value = f"{name} {session.telemetry.version or ''}".strip()
    differs = wanted.autopilot not in ("auto", name)
    return Finding("autopilot", value, f"the mission wants {wanted.autopilot}" if differs else "", differs)


def _link(session: Session) -> Finding:
    trip = session.round_trip_s
    if trip is None:
        return Finding("link", UNKNOWN, "it answers no TIMESYNC: nobody can tell whether it hears")
    slow = trip > MOST_ROUND_TRIP_S
    trouble = f"its link's round trip takes {trip:.1f} s, too long for setpoints" if slow else ""
    return Finding("link", f"{1000.0 * trip:.0f} ms", trouble, slow)


def _health(session: Session) -> Finding:
    """A position, and the firmware's own checks: a session that is READY has both."""
    if session.phase is Phase.READY:
        return Finding("health", "ready to arm")
    return Finding("health", session.phase.value, session.reason or "it did not become ready to arm", True)


def _battery(session: Session, kept_percent: float) -> Finding:
    percent = session.telemetry.battery_percent
    if percent is None:
        return Finding("battery", UNKNOWN, "it does not tell its battery: nobody will bring it home in time")
    low = percent <= kept_percent
    trouble = f"its battery is at {percent} %, and {kept_percent:g} % are kept for the return" if low else ""
    return Finding("battery", f"{percent} %", trouble, low)


def _home(session: Session) -> Finding:
    """Its home lies where it stands: its own return leads there, and heights are counted from it."""
    t = session.telemetry
    if t.home is None or not t.positioned:
        return Finding("home", UNKNOWN, "it has no home position", True)
    home = t.home
    away = math.hypot(
        *calls.to_local(t.lat_e7 * 1e-7, t.lon_e7 * 1e-7, home.lat_deg, home.lon_deg, home.alt_amsl_m)
    )
    above = abs(t.altitude_amsl_m - home.alt_amsl_m)
    far = away > STANDING_M or above > HOME_HEIGHT_M
    trouble = f"its home is {away:.0f} m away and {above:.0f} m off in height (set it anew)" if far else ""
    return Finding("home", f"{away:.1f} m", trouble, far)


def _fence(session: Session) -> Finding:
    """Its own geofence, read back, and what it would do on leaving it."""
    if not session.fence_verified:
        return Finding("fence", "not set", "the fence of the mission is not on board")
    does = session.protection.fence_action
    if does is None:
        return Finding("fence", "verified", "what it does on leaving its fence cannot be read")
    whys = "; ".join(
        f"{remedy.why} ({remedy.parameter} {remedy.value:g})" for remedy in session.protection.remedies
    )
    return Finding("fence", f"verified, {does}", f"{whys}: --adapt sets that" if whys else "")


def _failsafe(session: Session, rate_hz: float) -> Finding:
    """What it does when its controller is gone."""
    protection = session.protection
    value = protection.on_silence
    if protection.fatal:
        return Finding("if alone", value, protection.fatal, True)
    patience = protection.setpoint_loss_s
    if patience is not None and patience * rate_hz < LEAST_SETPOINTS:
        trouble = f"it waits only {patience:g} s for a setpoint, and {rate_hz:g} a second are sent"
        return Finding("if alone", value, trouble, True)
    trouble = "nothing brings it down when its controller is gone (set its ground station failsafe)"
    return Finding("if alone", value, trouble if protection.unattended else "")
