"""The swarm: sessions on one side, the compiled loop on the other, tick by tick.

All vehicles take off, wait for one another at the barrier, search, return and land.  A tick reads telemetry
into poses, plans if a planner period has passed, steers (homing and guard) and sends the setpoints.  It knows
neither sockets nor clocks: whoever drives it, in lockstep or live, says what time it is.

What goes wrong with one vehicle in the air, and what becomes of it and of the others:

| what | the vehicle | the others |
|---|---|---|
| failed, crashed, restarted, came down | told to land while it is armed | as `if_one_fails` says |
| mode changed by a pilot or a failsafe | released: no order reaches it until it is retaken | as `if_one_fails` says |
| released by order | the same | fly on |
| silent | its firmware's failsafe; ours again when heard in our mode | as `if_one_fails` says |
| position lost | lands where it is | as `if_one_fails` says |
| does not fly its setpoints | lands where it is | as `if_one_fails` says |
| link too slow for setpoints | lands where it is | as `if_one_fails` says |
| does not come home in time | lands where it is | return anyway |
| battery low | returns | fly on |
| battery all but empty | lands where it is | as `if_one_fails` says |

When all of ours are down, those that are not ours and still in the air are watched for a while: a silent one
is told to land once its own failsafe has had time to bring it home.
"""

from collections.abc import Sequence

import numpy as np

from swarmctl.core import calls, stages
from swarmctl.core.wire import COLUMNS
from swarmctl.core.world import World
from swarmctl.mission.model import Mission
from swarmctl.record.rows import STATE_S
from swarmctl.vehicle.events import Event, EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session

from .errors import RefusedError
from .following import Following
from .journal import Journal
from .parts import Part
from .preparation import Preparation
from .roster import Roster
from .supervision import SEARCHING, Supervision
from .taking_back import Resumed, TakingBack, whereabouts

QUIET = (EventKind.PHASE, EventKind.TEXT)
FAILURES = (EventKind.FAILED, EventKind.RELEASED, EventKind.LOST)
SEARCHING_SOON = (*SEARCHING, stages.TAKEN, stages.LEVEL)


class Swarm:
    """One flight of ``world``'s vehicles, session i flying row i.

    It begins with a preparation and take-off; or it resumes another, finding its vehicles in the air and going on
    where its search ended: ``world`` has its memory.
    """

    def __init__(
        self, mission: Mission, world: World, sessions: Sequence[Session], journal: Journal,
        start: Preparation | Resumed,
    ) -> None:  # fmt: skip
        self.part = Part.PREPARING
        self.search_began: float | None = None
        self.held = False
        self.broken_off = False  #: because of what went wrong with a vehicle
        before = start.before if isinstance(start, Resumed) else None
        #: planner ticks of the flight that is resumed
        self.ticks_before = before.restored.ticks if before else 0
        self.decisions = self.ticks_before * len(sessions)
        self.roster = Roster(world, sessions)
        self.in_range_total = before.searched.in_range if before else 0
        unseen = np.zeros((len(sessions), len(world.scene.targets)), bool)
        self.seen = before.searched.first_seen >= 0 if before else unseen  #: by each vehicle's own sensor
        self._mission, self._world, self._sessions, self._journal = mission, world, sessions, journal
        self._start = start
        origin = mission.origin
        self._origin = (origin.lat, origin.lon, origin.alt_m)
        self._wire = np.zeros((len(sessions), len(COLUMNS)))
        self._period = round(mission.planner.period_s * mission.setpoints.rate_hz)
        self._state_every = max(1, round(STATE_S / mission.planner.period_s))
        self._planner_ticks = round(mission.duration_s / mission.planner.period_s)
        self._began_at = 0
        self._following = Following(world, sessions, self.roster)
        self._supervision = Supervision(mission, world, sessions, self.roster, self._note)
        self._taking_back: TakingBack | None = None
        if isinstance(start, Resumed):
            self._taking_back = TakingBack(start.adoption, world, sessions, self.roster, self._note)

    @property
    def planner_tick(self) -> int:
        """How many planner periods have been planned."""
        return self.decisions // len(self._sessions)

    @property
    def sessions(self) -> Sequence[Session]:
        """The vehicles' sessions, row by row."""
        return self._sessions

    def stage(self, i: int) -> int:
        """What vehicle i is doing: one of core.stages."""
        return int(self._world.errands["stage"][i])

    @property
    def heights_m(self) -> list[float]:
        """The search height of each vehicle."""
        return [float(height) for height in self._world.fleet["altitude"]]

    def return_all(self, why: str, now: float) -> None:
        """Send everyone home who searches; before the search, land everyone where it is."""
        if self.part in (Part.RETURNING, Part.WATCHING, Part.OVER):
            return
        self.resume(now)
        self._journal.event(now, 0, "return", why)
        if self.part in (Part.PREPARING, Part.TAKING_OFF):
            self.roster.land()
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
        """Land everyone where it is, at once; when only others' vehicles are left in the air, watch them no more."""
        self._journal.event(now, 0, "land", "ordered by the operator")
        if self.part is Part.WATCHING:
            self._end(now)
        else:
            self.roster.land()
            self.part = Part.RETURNING

    def release(self, i: int, now: float) -> None:
        """Leave one vehicle to somebody else; the others fly on.  Raises OrderError."""
        self._sessions[i].release()
        self.roster.by_order.add(i)
        self._note(i, now, "release", "released by the operator")

    def retake(self, i: int, now: float) -> None:
        """Take a released vehicle back: it searches on, or returns when the others do.  Raises OrderError."""
        self._supervision.require_inside(i)
        self._sessions[i].retake()
        self._note(i, now, "retake", "retaken by the operator")
        self._return_if_alone()

    def stood_still(self, now: float, stood_s: float) -> None:
        """The controller itself was silent for ``stood_s``."""
        for i in filter(self.roster.flies, range(len(self._sessions))):
            self._note(i, now, "standstill", f"the controller stood still for {stood_s:.1f} s")

    def _note(self, i: int, now: float, kind: str, text: str) -> None:
        """Something that the swarm did with one vehicle, for the recording and for people."""
        self._journal.event(now, self._sessions[i].system, kind, text)
        self.roster.note(i, now, text)

    def tick(self, k: int, now: float) -> None:
        """One setpoint tick at flight time ``now``; the sessions have taken in what arrived by then."""
        self._take_events(now)
        self._read_telemetry(now)
        self._go_on(k, now)
        waits = self.held or self.part in (Part.TAKING_OFF, Part.TAKING_BACK)
        self._following.follow(waits, self.part in (Part.RETURNING, Part.WATCHING))
        self._supervise(now)
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
                    self.roster.note(i, event.time, event.text)
                self._mind(i, event, now)

    def _mind(self, i: int, event: Event, now: float) -> None:
        """Something went wrong with a vehicle: the mission says whether the others go on."""
        if event.kind is EventKind.REGAINED:
            self._welcome(i)
        elif event.kind is EventKind.ASTRAY:
            self._bring_down(i, now, "lands where it is")
        elif event.kind is EventKind.POSITION_LOST and self.part is not Part.PREPARING:
            self._trouble(i, event.text, now)
        elif event.kind in FAILURES:
            if event.kind is EventKind.LOST and self.part is Part.PREPARING:
                return  # nothing is armed: it may come back, and the preparation waits only so long
            self.roster.drop(i, event.kind)
            if i not in self.roster.by_order:
                self._mind_the_others(event.text, now)

    def _mind_the_others(self, why: str, now: float) -> None:
        safety = self._mission.safety
        if safety.if_one_fails == "abort" or len(self.roster.active) < safety.minimum_vehicles:
            self.broken_off |= self.part in (Part.TAKING_OFF, Part.TAKING_BACK, Part.SEARCHING)
            self.return_all(why, now)

    def _welcome(self, i: int) -> None:
        """A vehicle that was silent speaks again: it belongs to the swarm, unless that took off without it."""
        if self.roster.dropped[i] == "lost" and self.roster.flies(i):
            self.roster.take_back(i)
            self._return_if_alone()

    def _return_if_alone(self) -> None:
        """One is ours again: if all others are down, it is to come home."""
        if self.part is Part.WATCHING:
            self.part = Part.RETURNING

    def _supervise(self, now: float) -> None:
        """Heed what no session tells."""
        if self.part is Part.SEARCHING:
            self._supervision.heed_batteries(now)
        if self.part in (Part.TAKING_BACK, Part.SEARCHING, Part.RETURNING):
            for i in self._supervision.exhausted():
                self._bring_down(i, now, "battery all but empty: lands where it is")
            for i in self._supervision.out_of_touch(now):
                self._bring_down(i, now, "its link is too slow for setpoints: lands where it is")
        if self.part is Part.RETURNING:
            for i in self._supervision.overdue(now):
                self._bring_down(i, now, "did not come home in time: lands where it is")

    def _bring_down(self, i: int, now: float, why: str) -> None:
        """Land a vehicle that we cannot fly home."""
        self._note(i, now, "land", why)
        self._sessions[i].land()
        self._trouble(i, f"vehicle {self._sessions[i].system} {why}", now)

    def _trouble(self, i: int, why: str, now: float) -> None:
        """It lands where it should not: it is no more use to the search, and the mission says who goes on."""
        self.roster.troubled[i] = True
        self.roster.deafen(i)
        self._mind_the_others(why, now)

    def _read_telemetry(self, now: float) -> None:
        rows = []
        for session in self._sessions:
            t = session.telemetry
            age = now - t.received_at + t.age_s if t.positioned else 0.0
            rows.append((t.lat_e7, t.lon_e7, t.height_m, t.v_east, t.v_north, t.v_up, age))
        self._wire[:] = rows
        self.roster.look()
        calls.read_poses(self._wire, self._world.poses, *self._origin)

    def _go_on(self, k: int, now: float) -> None:
        """Move on to the next part of the flight when everybody is ready for it."""
        if self.part is Part.PREPARING:
            self._await_start(now)
        elif self.part is Part.TAKING_OFF:
            self._engage(k, now)
        elif self.part is Part.TAKING_BACK and self._taking_back and self._taking_back.over(now):
            self._begin_search(k, now)
        elif self.part is Part.SEARCHING and not self._anybody_searches():
            self.part = Part.RETURNING
        if self._taking_back is not None and self.part is not Part.OVER:
            self._taking_back.tick(now)
        ends = self.part in (Part.RETURNING, Part.WATCHING) or self.roster.empty
        if ends and self.part is not Part.OVER and not self.roster.anybody_flies_for_us:
            self._watch(now)

    def _engage(self, k: int, now: float) -> None:
        """Take control of those that are up; when all are, the search begins."""
        active = self.roster.active
        for session in active:
            if session.phase is Phase.HOLDING:
                session.engage()
        if active and all(session.phase is Phase.ENGAGED for session in active):
            self._begin_search(k, now)

    def _watch(self, now: float) -> None:
        """None of ours is in the air: the flight is over when nobody is, or after a while."""
        if self._supervision.watch(now):
            self.part = Part.WATCHING
        else:
            self._end(now)

    def _end(self, now: float) -> None:
        """The flight is over; who may still be in the air is told."""
        self.part = Part.OVER
        for i in self.roster.unattended():
            self._note(
                i, now, "left", f"left in the air, as far as is known: {whereabouts(self._sessions[i])}"
            )

    def _anybody_searches(self) -> bool:
        return any(stage in SEARCHING_SOON for stage in self._world.errands["stage"].tolist())

    def _await_start(self, now: float) -> None:
        """Take off when the preparation is over, or take back those that are in the air already."""
        if isinstance(self._start, Preparation):
            self._await_ready(self._start, now)
        elif self._taking_back is not None:
            self.part = Part.TAKING_BACK
            self._journal.state(self.ticks_before, now)
            self._taking_back.begin(now)

    def _await_ready(self, preparation: Preparation, now: float) -> None:
        """Take off when the preparation is over.  Raises RefusedError if it refuses one that is needed."""
        preparation.tick(now)
        if not preparation.done:
            return
        preparation.require()
        for i in preparation.refusals:
            if self.roster.dropped[i] is None:
                self.roster.refuse(i)
                self._note(i, now, "refused", preparation.refusals[i])
        if all(session.phase is Phase.READY for session in self.roster.active):
            self._take_off(now)
        elif now > preparation.deadline:
            late = [s for s in self.roster.active if s.phase is not Phase.READY]
            raise RefusedError("\n".join(f"vehicle {s.system} is {s.phase.value} again" for s in late))

    def _take_off(self, now: float) -> None:
        """Everybody is ready: go."""
        self.part = Part.TAKING_OFF
        self._journal.event(now, 0, "take-off", f"{len(self.roster.active)} vehicles")
        for i, session in enumerate(self._sessions):
            if session.phase is Phase.READY and self.roster.dropped[i] is None:
                session.take_off(float(self._world.fleet[i]["altitude"]))

    def _begin_search(self, k: int, now: float) -> None:
        """The barrier opens: from this tick on everybody follows its planner."""
        if self.ticks_before == 0:
            self._world.prepare()
        engaged = np.array([session.phase is Phase.ENGAGED for session in self._sessions])
        stage = self._world.errands["stage"]
        stage[engaged & (stage == stages.HOLD)] = stages.SEARCH
        self.part, self.search_began = Part.SEARCHING, now
        self._began_at = k - self.ticks_before * self._period
        self._journal.event(now, 0, "search", f"all vehicles are up; planner tick {self.ticks_before}")
        if isinstance(self._start, Resumed):
            self._go_on_as_ordered(self._start.before.order, now)

    def _go_on_as_ordered(self, order: str, now: float) -> None:
        """Resumed: what had been ordered still holds, and so does how many are needed."""
        searching = np.count_nonzero(np.isin(self._world.errands["stage"], SEARCHING_SOON))
        if order == "hold":
            self.hold(now)
        elif order == "land":
            self.land_all(now)
        elif order == "return":
            self.return_all("as before the controller died", now)
        elif searching < self._mission.safety.minimum_vehicles:
            self.return_all("too few vehicles are left", now)

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
        if any(world.orders.tolist()):
            world.begin_return(now)
        world.steer(now)
        self._journal.after_steering(k, now)
        for session, (v_east, v_north, up, _) in zip(self._sessions, world.setpoints.tolist(), strict=True):
            session.setpoint(v_east, v_north, up)
