"""The swarm: sessions on one side, the compiled loop on the other, tick by tick.

All vehicles take off, wait for one another at the barrier, search, return and land.  A tick reads telemetry
into poses, plans if a planner period has passed, steers (homing and guard) and sends the setpoints.  It knows
neither sockets nor clocks: whoever drives it, in lockstep or live, says what time it is.
"""

from collections.abc import Sequence
from enum import Enum

import numpy as np

from swarmctl.core import calls, stages
from swarmctl.core.wire import COLUMNS
from swarmctl.core.world import World
from swarmctl.mission.model import Mission
from swarmctl.record.rows import STATE_S
from swarmctl.vehicle.events import Event, EventKind
from swarmctl.vehicle.phases import FLYING, Phase
from swarmctl.vehicle.session import OrderError, Session

from .journal import Journal

EARS = ("sensor_range", "alarms_per_second", "radio_range")
"""What a vehicle that dropped out has no more."""
LOW_M = 0.5
STANDING_M = 5.0
"""A vehicle must stand within so much of the place where the mission expects it."""

STAGE_OF = {
    Phase.TAKING_OFF: stages.TAKE_OFF,
    Phase.HOLDING: stages.HOLD,
    Phase.ENGAGING: stages.HOLD,
    Phase.LANDING: stages.LAND,
    Phase.LANDED: stages.LANDED,
    Phase.STOPPING: stages.HOLD,
    Phase.RELEASING: stages.HOLD,
}
GONE = (Phase.FAILED, Phase.RELEASED, Phase.LOST)
QUIET = (EventKind.PHASE, EventKind.TEXT)


CONNECT_S = 20.0
"""A vehicle that was not heard by then is not there."""
PREPARE_S = 180.0
"""One that is not ready to arm by then is not going to be."""


class FlightError(Exception):
    """The flight cannot begin or go on; the message says which vehicle and why."""


class RefusedError(FlightError):
    """No vehicle, too few, or one that refuses: nothing was armed."""


class Part(Enum):
    """What the swarm as a whole is doing."""

    PREPARING = "preparing"
    TAKING_OFF = "taking off"
    SEARCHING = "searching"
    RETURNING = "returning"
    OVER = "over"


class Swarm:
    """One flight of ``world``'s vehicles, session i flying row i."""

    def __init__(self, mission: Mission, world: World, sessions: Sequence[Session], journal: Journal) -> None:
        self.part = Part.PREPARING
        self.search_began: float | None = None
        self.held = False
        self.decisions = 0
        self.messages: list[list[str]] = [[] for _ in sessions]  #: what happened to each vehicle, for people
        self.in_range_total = 0
        self.seen = np.zeros((len(sessions), len(world.scene.targets)), bool)  #: by each vehicle's own sensor
        self._mission, self._world, self._sessions, self._journal = mission, world, sessions, journal
        origin = mission.origin
        self._origin = (origin.lat, origin.lon, origin.alt_m)
        self._wire = np.zeros((len(sessions), len(COLUMNS)))
        self._period = round(mission.planner.period_s * mission.setpoints.rate_hz)
        self._state_every = max(1, round(STATE_S / mission.planner.period_s))
        self._planner_ticks = round(mission.duration_s / mission.planner.period_s)
        self._began_at = 0
        self.dropped: list[str | None] = [None] * len(
            sessions
        )  #: refused, crashed, released or lost, once it was
        self._flown = [False] * len(sessions)
        self._battery_low = [False] * len(sessions)
        self._ears = {name: world.fleet[name].copy() for name in EARS}

    @property
    def planner_tick(self) -> int:
        """How many planner periods have been planned."""
        return self.decisions // len(self._sessions)

    @property
    def heights_m(self) -> list[float]:
        """The search height of each vehicle."""
        return [float(height) for height in self._world.fleet["altitude"]]

    def return_all(self, why: str, now: float) -> None:
        """Send everyone home who searches; before the search, land everyone where it is."""
        if self.part in (Part.RETURNING, Part.OVER):
            return
        self.resume(now)
        self._journal.event(now, 0, "return", why)
        if self.part is not Part.SEARCHING:
            self._land_airborne()
        else:
            self._world.orders[:] |= self._world.errands["stage"] == stages.SEARCH
        self.part = Part.RETURNING

    def hold(self, now: float) -> None:
        """Everybody stands still in the air; the search's clock stands still too."""
        if self.part is Part.SEARCHING:
            self.held = True
            self._journal.event(now, 0, "hold", "ordered by the operator")
            self._change_stage(stages.SEARCH, stages.HOLD)

    def resume(self, now: float) -> None:
        """Go on searching after `hold`."""
        if self.held:
            self.held = False
            self._journal.event(now, 0, "resume", "ordered by the operator")
            self._change_stage(stages.HOLD, stages.SEARCH)

    def _change_stage(self, old: int, new: int) -> None:
        stage = self._world.errands["stage"]
        stage[stage == old] = new

    def land_all(self, now: float) -> None:
        """Land everyone where it is, at once."""
        self._journal.event(now, 0, "land", "ordered by the operator")
        self._land_airborne()
        self.part = Part.RETURNING

    def tick(self, k: int, now: float) -> None:
        """One setpoint tick at flight time ``now``; the sessions have taken in what arrived by then."""
        self._take_events(now)
        self._read_telemetry(now)
        self._go_on(k, now)
        self._follow_stages()
        if self.part is Part.SEARCHING:
            for i in range(len(self._sessions)):
                self._heed_battery(i, now)
        self._began_at += self.held
        ahead = k - self._began_at
        if self.part is Part.SEARCHING and not self.held and ahead % self._period == 0:
            if ahead // self._period < self._planner_ticks:
                self._plan(ahead // self._period, now)
            else:
                self.return_all("the search is over", now)
        if self.part is not Part.PREPARING:
            self._steer(k, now)

    def _take_events(self, now: float) -> None:
        """Pass on what sessions report, and act on vehicles that dropped out."""
        for i, session in enumerate(self._sessions):
            for event in session.events():
                self._journal.event(event.time, event.system, event.kind.value, event.text)
                if event.kind not in QUIET:
                    self.messages[i].append(f"{event.time:.1f} s: {event.text}")
                self._mind(i, event, now)

    def _mind(self, i: int, event: Event, now: float) -> None:
        """A vehicle failed, was taken over or is silent: the mission says whether the others go on."""
        if event.kind is EventKind.REGAINED and self.dropped[i] == "lost":
            self._take_back(i)
        if event.kind not in (EventKind.FAILED, EventKind.RELEASED, EventKind.LOST):
            return
        self._drop(i, event.kind)
        left = self.dropped.count(None)
        safety = self._mission.safety
        if safety.if_one_fails == "abort" or left < safety.minimum_vehicles:
            self.return_all(event.text, now)

    def _drop(self, i: int, kind: EventKind) -> None:
        """Note how a vehicle was lost to the swarm; it sees and tells nothing more.  Failed in the air, it lands."""
        session = self._sessions[i]
        if self.dropped[i] is None:
            failed = "crashed" if self._flown[i] and not session.telemetry.armed else "refused"
            self.dropped[i] = {EventKind.RELEASED: "released", EventKind.LOST: "lost"}.get(kind, failed)
        for name in EARS:
            self._world.fleet[name][i] = 0.0
        if kind is EventKind.FAILED and session.telemetry.armed:
            session.land()

    def _take_back(self, i: int) -> None:
        """A vehicle that was silent speaks again: it belongs to the swarm, unless that took off without it."""
        if self.part is Part.PREPARING or self._flies(i):
            self.dropped[i] = None
            for name in EARS:
                self._world.fleet[name][i] = self._ears[name][i]

    def _flies(self, i: int) -> bool:
        """Whether the vehicle is in the air, as far as is known."""
        return bool(stages.airborne(int(self._world.errands["stage"][i])))

    def _heed_battery(self, i: int, now: float) -> None:
        """Send a searching vehicle home when its battery is down to what the mission keeps for the return."""
        percent, limit = (
            self._sessions[i].telemetry.battery_percent,
            self._mission.safety.battery_return_percent,
        )
        if self._battery_low[i] or percent is None or percent > limit:
            return
        if self._world.errands["stage"][i] == stages.SEARCH:
            self._battery_low[i] = True
            self._world.orders[i] = 1
            text = f"battery at {percent} %: returns"
            self._journal.event(now, self._sessions[i].system, "battery", text)
            self.messages[i].append(f"{now:.1f} s: {text}")

    def _read_telemetry(self, now: float) -> None:
        for i, session in enumerate(self._sessions):
            t = session.telemetry
            self._flown[i] |= t.height_m > LOW_M
            age = now - t.received_at if t.positioned else 0.0
            self._wire[i] = (t.lat_e7, t.lon_e7, t.height_m, t.v_east, t.v_north, t.v_up, age)
        calls.read_poses(self._wire, self._world.poses, *self._origin)

    def _go_on(self, k: int, now: float) -> None:
        """Move on to the next part of the flight when everybody is ready for it."""
        active = [s for s, gone in zip(self._sessions, self.dropped, strict=True) if gone is None]
        if self.part is Part.PREPARING:
            self._await_ready(active, now)
        elif self.part is Part.TAKING_OFF:
            for session in active:
                if session.phase is Phase.HOLDING:
                    session.engage()
            if active and all(session.phase is Phase.ENGAGED for session in active):
                self._begin_search(k, now)
        elif self.part is Part.SEARCHING and not self._anybody_searches():
            self.part = Part.RETURNING
        landed = self.part is Part.RETURNING and not any(s.phase in FLYING for s in self._sessions)
        if landed or (not active and not any(s.phase in FLYING for s in self._sessions)):
            self.part = Part.OVER

    def _anybody_searches(self) -> bool:
        stage = self._world.errands["stage"]
        return bool(((stage == stages.SEARCH) | (stage == stages.HOLD)).any())

    def _await_ready(self, active: Sequence[Session], now: float) -> None:
        """Take off when everybody is ready.  Raises RefusedError if somebody has not become so in time."""
        if active and all(session.phase is Phase.READY for session in active):
            self._take_off(now)
        elif now > PREPARE_S or (now > CONNECT_S and any(s.phase is Phase.CONNECTING for s in active)):
            late = [s for s in active if s.phase is not Phase.READY]
            raise RefusedError(
                "\n".join(f"vehicle {s.system} is still {s.phase.value} at {now:.0f} s" for s in late)
            )

    def _take_off(self, now: float) -> None:
        """Everybody is ready: check where they stand, then go."""
        self._check_places()
        self.part = Part.TAKING_OFF
        self._journal.event(now, 0, "take-off", f"{len(self._sessions)} vehicles")
        for i, session in enumerate(self._sessions):
            if session.phase is Phase.READY:
                session.take_off(float(self._world.fleet[i]["altitude"]))

    def _check_places(self) -> None:
        """Raise FlightError if a vehicle does not stand where the mission expects it."""
        poses, fleet = self._world.poses, self._world.fleet
        off = np.hypot(poses["east"] - fleet["pad_east"], poses["north"] - fleet["pad_north"])
        for i in np.flatnonzero(off > STANDING_M).tolist():
            raise FlightError(
                f"vehicle {self._sessions[i].system} stands {off[i]:.0f} m from its launch place"
                " (check the mission's origin and launch)"
            )

    def _begin_search(self, k: int, now: float) -> None:
        """The barrier opens: from this tick on everybody follows its planner."""
        self._world.prepare()
        engaged = [session.phase is Phase.ENGAGED for session in self._sessions]
        self._world.errands["stage"][engaged] = stages.SEARCH
        self.part, self.search_began, self._began_at = Part.SEARCHING, now, k
        self._journal.event(now, 0, "search", "all vehicles are up")

    def _follow_stages(self) -> None:
        """Stages that firmware flies follow the session; those that the loop flies are the loop's own."""
        errands = self._world.errands
        for i, session in enumerate(self._sessions):
            stage = STAGE_OF.get(session.phase)
            if stage is not None:
                errands[i]["stage"] = stage
            elif session.phase in GONE:
                aloft = self._flies(i) and session.telemetry.height_m > LOW_M
                errands[i]["stage"] = stages.ADRIFT if aloft else stages.GROUND
            elif session.phase is Phase.ENGAGED and errands[i]["stage"] == stages.ADRIFT:
                errands[i]["stage"] = stages.SEARCH  # silent for a while, and still ours
                self._world.orders[i] = self.part is Part.RETURNING
            elif session.phase is Phase.ENGAGED and errands[i]["stage"] == stages.LAND:
                session.land()

    def _land_airborne(self) -> None:
        for session in self._sessions:
            try:
                session.land()
            except OrderError:
                continue  # on the ground, or no longer ours

    def _plan(self, tick: int, now: float) -> None:
        """Sense → know ⇄ radio → plan, for everybody."""
        world = self._world
        if tick % self._state_every == 0:
            self._journal.state(tick, now)
        world.observe(tick)
        world.share(tick)
        world.deliver(tick)
        world.decide(tick)
        self._journal.planner_tick(tick, now)
        self.decisions += len(self._sessions)
        for i, count in enumerate(world.report_count):
            serials = world.reports[i, :count]["id"]
            true = serials[serials < self.seen.shape[1]]  # the others are false alarms
            self.seen[i, true] = True
            self.in_range_total += len(true)

    def _steer(self, k: int, now: float) -> None:
        """Homing and guard for everybody, and the setpoints to those that take them."""
        world = self._world
        self._journal.before_steering()
        if world.orders.any():
            world.begin_return(now)
        world.steer(now)
        self._journal.after_steering(k, now)
        for session, (v_east, v_north, up, _) in zip(self._sessions, world.setpoints.tolist(), strict=True):
            session.setpoint(v_east, v_north, up)
