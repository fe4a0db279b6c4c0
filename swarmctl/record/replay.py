"""Replay: recorded inputs in, the recorded decisions out, one step at a time.

The recording holds what each stage was given, so nothing is simulated: sensor reports, beacons and who heard
them go into know and plan, poses and orders into homing and guard, and what comes out is compared bit for bit
with what was recorded.  Memory is chained from tick to tick and put back at every snapshot.  A decision counts
as identical if the wish and every setpoint until the next decision are.
"""

import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from swarmctl.core import planners, stages, state
from swarmctl.core.arrays import Records
from swarmctl.core.world import Fences, Scene, World, make_settings

from . import rows
from .errors import LogError
from .mcap_read import Log, Rows

OUTPUTS = (stages.CLIMB, stages.TRANSIT, stages.OVER_PAD, stages.DESCEND, stages.LEVEL)
"""Stages that steering itself moves a vehicle on to."""
ONCE = ("/rules", "/fleet", "/settings", "/targets", "/fence")


@dataclass
class Replayed:
    """What a replay found.

    ``largest_difference_mps`` is of any velocity component, wished or set; ``mean_difference_mps`` is the mean
    length of the difference between recorded and recomputed wishes.
    """

    decisions: int = 0
    identical: int = 0
    setpoints: int = 0
    setpoints_identical: int = 0
    largest_difference_mps: float = 0.0
    mean_difference_mps: float = 0.0
    first_difference: dict[str, Any] | None = None
    truncated: bool = False

    def as_json(self) -> dict[str, Any]:
        """The content of ``replay --json``."""
        return asdict(self)

    def as_text(self) -> str:
        """A few lines for a person: how many are identical, or the first that is not and what went in."""
        lines = [f"{self.identical} of {self.decisions} decisions identical"]
        if self.setpoints:
            lines[0] += f", {self.setpoints_identical} of {self.setpoints} setpoints"
        if not self.same:
            lines.append(
                f"wishes differ by {self.mean_difference_mps:.3g} m/s on average, "
                f"velocities by {self.largest_difference_mps:.6g} m/s at most; the first that does:"
            )
            lines.append(json.dumps(self.first_difference, indent=2))
        if self.truncated:
            lines.append("the recording is cut off; this is all that it holds")
        return "\n".join(lines)

    @property
    def same(self) -> bool:
        """Whether everything was recomputed to the last bit."""
        return self.identical == self.decisions and self.setpoints_identical == self.setpoints


def as_now(recorded: Records, dtype: np.dtype[Any], topic: str) -> Records:
    """Recorded rows as today's dtype, by the fields' names.  Raises LogError if one is missing."""
    missing = set(dtype.names or ()) - set(recorded.dtype.names or ())
    if missing:
        raise LogError(
            f"{topic}: recorded by a version without {', '.join(sorted(missing))}; use that version"
        )
    converted = np.zeros(len(recorded), dtype)
    for name in dtype.names or ():
        converted[name] = recorded[name]
    return converted


def require_below(limit: int, values: Records, topic: str) -> None:
    """Raise LogError for an index that would lead out of an array."""
    if len(values) and not (values.min() >= 0 and values.max() < limit):
        raise LogError(f"{topic}: a number is out of range; the recording was tampered with")


def open_world(log: Log, algorithm: str | None = None) -> World:
    """The world of a recording, at its start; with another algorithm, that one's own default settings."""
    found: dict[str, Records] = {}
    for message in log.rows(*ONCE):
        found.setdefault(message.topic, message.rows)
        if len(found) == len(ONCE):
            break
    about = log.metadata.get("flight", {})
    if len(found) < len(ONCE) or "algorithm" not in about:
        raise LogError(f"{log.path}: no flight in it (the recording ended before it began)")
    fence = as_now(found["/fence"], rows.FENCE, "/fence")
    edges = [
        np.column_stack([fence[n][fence["kind"] == kind] for n in ("x0", "y0", "x1", "y1")])
        for kind in range(3)
    ]
    targets = as_now(found["/targets"], state.TARGET, "/targets")
    # Replay senses nothing: the targets are here for their number and for pictures.
    scene = Scene(targets, np.zeros(1, state.GRID), np.zeros((2, 2), np.int64))
    recorded = about["algorithm"]
    if recorded not in planners.MODULES:
        raise LogError(f"{log.path}: flown with {recorded}, which this version does not know")
    settings = make_settings(algorithm or recorded, {})
    if algorithm in (None, recorded):
        settings = as_now(found["/settings"], settings.dtype, "/settings")
    rules = as_now(found["/rules"], state.RULES, "/rules")
    if not (rules["interval"][0] > 0 and min(rules["radio_delay"][0], rules["alarm_slots"][0]) >= 0):
        raise LogError(f"{log.path}: /rules: a number is out of range; the recording was tampered with")
    return World(
        algorithm or recorded,
        as_now(found["/fleet"], state.VEHICLE, "/fleet"),
        rules,
        scene,
        Fences(*(np.ascontiguousarray(e) for e in edges)),
        settings,
    )


def replay(log: Log, algorithm: str | None = None) -> Replayed:
    """Recompute a recording's decisions, with ``algorithm`` in place of the recorded one if it is another.

    With another algorithm only the plans are compared: the recorded setpoints followed from other wishes.
    """
    other = algorithm is not None and algorithm != log.metadata.get("flight", {}).get("algorithm")
    replayer = _Replayer(open_world(log, algorithm), other)
    for message, pending in _whole_ticks(log):
        replayer.tick(message, pending)
    replayer.result.truncated = log.truncated
    return replayer.finish()


@dataclass(frozen=True)
class Restored:
    """The world as it was after the last whole planner tick of a recording, ``ticks`` being how many there were.

    ``exact``: what was done again since the last snapshot came out as recorded.
    """

    world: World
    ticks: int
    exact: bool


def restore(log: Log) -> Restored:
    """Memory at the end of a recording: that of the last snapshot, and the planner ticks after it done again."""
    since: list[tuple[Rows, dict[str, Rows]]] = []
    for message, pending in _whole_ticks(log):
        if "/state" in pending:
            since.clear()
        if "/state" in pending or "/decisions" in pending:
            since.append((message, pending))
    replayer = _Replayer(open_world(log), other=False, steers=False)
    ticks = 0
    for message, pending in since:
        replayer.tick(message, pending)
        ticks = pending["/decisions"].tick + 1 if "/decisions" in pending else pending["/state"].tick
    return Restored(replayer.world, ticks, replayer.finish().same)


def _whole_ticks(log: Log) -> Iterator[tuple[Rows, dict[str, Rows]]]:
    """Every setpoint tick that is all there, with what was recorded just before it, by topic."""
    pending: dict[str, Rows] = {}
    for message in log.rows():
        if message.topic == "/ticks":
            yield message, pending
            pending = {}
        elif message.topic not in ONCE:
            pending[message.topic] = message


@dataclass
class _Replayer:
    """A world into which recorded ticks are fed."""

    world: World
    other: bool
    steers: bool = True
    result: Replayed = field(default_factory=Replayed)
    begun: bool = False
    launched: bool = False  # its planners have memory
    apart_mps: float = 0.0

    def __post_init__(self) -> None:
        self.good = np.zeros(len(self.world.fleet), bool)  # the current decision's standing, per vehicle

    def tick(self, message: Rows, pending: dict[str, Rows]) -> None:
        """One recorded setpoint tick, with the planner tick that came before it, if one did."""
        recorded = as_now(message.rows, rows.TICK, "/ticks")
        for name in state.POSE.names or ():
            self.world.poses[name] = recorded[name]
        if "/state" in pending and not self.other:
            self._take_state(pending["/state"])
        if "/decisions" in pending:
            self._plan(pending)
        if self.steers and not self.other:
            self._steer(message, recorded)

    def finish(self) -> Replayed:
        """Close the last decision and give the result."""
        if self.begun:
            self.result.identical += int(self.good.sum())
            self.result.mean_difference_mps = self.apart_mps / self.result.decisions
            self.begun = False
        return self.result

    def _plan(self, pending: dict[str, Rows]) -> None:
        world, decided = self.world, pending["/decisions"]
        tick = decided.tick
        self.finish()
        if not self.launched:
            self.launched = True
            world.prepare()
        self._give_reports(as_now(pending["/observations"].rows, rows.OBSERVATION, "/observations"))
        self.begun = True
        self.good[:] = True
        self.result.decisions += len(world.fleet)
        world.share(tick)
        if not self.other:
            beacons = as_now(pending["/beacons"].rows, world.beacons.dtype, "/beacons")
            self._compare("beacon", tick, decided.time_s, beacons, world.beacons[tick % world.depth])
            world.beacons[tick % world.depth] = beacons
        self._give_heard(as_now(pending["/heard"].rows, rows.HEARD, "/heard"), tick % world.depth)
        world.decide(tick)
        recorded = as_now(decided.rows, rows.DECISION, "/decisions")
        apart = (recorded[name] - world.wishes[name] for name in ("v_east", "v_north"))
        lengths = np.hypot(*apart)
        self.apart_mps += float(lengths[np.isfinite(lengths)].sum())
        self._compare("plan", tick, decided.time_s, recorded, rows.decisions(world))

    def _take_state(self, snapshot: Rows) -> None:
        """Compare all chained memory with the recorded snapshot, then go on from that."""
        world, recorded = self.world, snapshot.rows.tobytes()
        self.finish()
        self.launched = True
        if self.result.decisions and rows.dump_state(world) != recorded:
            self.result.identical -= int(self.good.sum())
            if self.result.first_difference is None:
                self.result.first_difference = {
                    "stage": "memory",
                    "tick": snapshot.tick,
                    "time_s": snapshot.time_s,
                }
        try:
            rows.load_state(world, recorded)
        except (ValueError, IndexError):
            raise LogError("/state: recorded by a version with other memory; use that version") from None

    def _give_reports(self, recorded: Records) -> None:
        require_below(len(self.world.fleet), recorded["vehicle"], "/observations")
        require_below(self.world.serials, recorded["id"], "/observations")
        self.world.report_count[:] = 0
        for row in recorded:
            vehicle = int(row["vehicle"])
            place = self.world.reports[vehicle, self.world.report_count[vehicle]]
            for name in state.CONTACT.names or ():
                place[name] = row[name]
            self.world.report_count[vehicle] += 1

    def _give_heard(self, recorded: Records, slot: int) -> None:
        for name in ("receiver", "sender"):
            require_below(len(self.world.fleet), recorded[name], "/heard")
        senders: dict[int, list[int]] = defaultdict(list)
        for receiver, sender in recorded.tolist():
            senders[receiver].append(sender)
        for i in range(len(self.world.fleet)):
            self.world.heard_count[slot, i] = len(senders[i])
            self.world.heard[slot, i, : len(senders[i])] = senders[i]

    def _steer(self, message: Rows, recorded: Records) -> None:
        world = self.world
        self._check_stages(message, recorded["stage"])
        world.errands["stage"] = recorded["stage"]
        world.orders[:] = recorded["ordered_home"]
        if world.orders.any():
            world.begin_return(message.time_s)
        world.steer(message.time_s)
        computed = recorded.copy()
        rows.tick_outputs(world, computed)
        self.result.setpoints += len(computed)
        same = self._compare("guard", message.tick, message.time_s, recorded, computed)
        self.result.setpoints_identical += same

    def _check_stages(self, message: Rows, recorded: Records) -> None:
        """Steering's own steps are outputs: where the recording shows one, the last tick must have led there."""
        wrong = np.isin(recorded, OUTPUTS) & (recorded != self.world.errands["stage"])
        wrong &= np.isin(self.world.errands["stage"], (stages.WAIT, stages.TAKEN, *OUTPUTS))
        self.good &= ~wrong
        if wrong.any() and self.result.first_difference is None:
            i = int(np.flatnonzero(wrong)[0])
            self.result.first_difference = {
                "stage": "homing",
                "tick": message.tick,
                "time_s": message.time_s,
                "vehicle": i + 1,
                "recorded": stages.NAMES[int(recorded[i])],
                "recomputed": stages.NAMES[int(self.world.errands["stage"][i])],
            }

    def _compare(self, stage: str, tick: int, time_s: float, recorded: Records, computed: Records) -> int:
        """Count the rows that are equal bit for bit, and keep the first that is not."""
        if recorded.tobytes() == computed.tobytes():
            return len(recorded)
        same = np.array([a.tobytes() == b.tobytes() for a, b in zip(recorded, computed, strict=True)])
        self.good &= same
        for name in computed.dtype.names or ():
            if name.endswith(("v_east", "v_north")):
                apart = np.abs(recorded[name] - computed[name])
                difference = float(apart[np.isfinite(apart)].max(initial=0.0))
                self.result.largest_difference_mps = max(self.result.largest_difference_mps, difference)
        if self.result.first_difference is None and not same.all():
            i = int(np.flatnonzero(~same)[0])
            self.result.first_difference = self._explain(stage, tick, time_s, i, recorded[i], computed[i])
        return int(same.sum())

    def _explain(
        self, stage: str, tick: int, time_s: float, i: int, recorded: np.void, computed: np.void
    ) -> dict[str, Any]:
        """What went in and what came out, for a person to look at."""
        world, slot = self.world, self.world.arriving(tick) if stage == "plan" else 0
        heard = world.heard[slot, i, : world.heard_count[slot, i]].tolist() if stage == "plan" else []
        return {
            "stage": stage,
            "tick": tick,
            "time_s": time_s,
            "vehicle": i + 1,
            "input": {
                "pose": _plain(world.poses[i]),
                "knowledge": _plain(world.knowledge[i]),
                "memory": _plain(world.memory[i]),
                "heard": [j + 1 for j in heard],
            },
            "recorded": _plain(recorded),
            "recomputed": _plain(computed),
        }


def _plain(record: np.void) -> dict[str, Any]:
    """A record as JSON can hold it; numbers that JSON lacks as text."""
    return {name: _plain_value(record[name].tolist()) for name in record.dtype.names or ()}


def _plain_value(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain_value(item) for item in value]
    return value if not isinstance(value, float) or np.isfinite(value) else str(value)
