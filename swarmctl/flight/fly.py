"""One flight in lockstep from mission to run folder: set up, fly, write down."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from swarmctl import __version__
from swarmctl.core import bind, calls
from swarmctl.core.wire import COLUMNS
from swarmctl.core.world import World
from swarmctl.mission.dump import dump
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario
from swarmctl.record.folder import RunFolder
from swarmctl.record.tracks import Picture, draw, subtitle_of
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from . import clock
from .errors import StoppedError
from .journal import Journal
from .lockstep import Lockstep, Vehicles
from .orders import Orders
from .parts import Part
from .preparation import Preparation
from .results import Outcome
from .swarm import Swarm
from .track import Track

REPORT_EVERY_S = 10.0
STUB_RESERVE_S = 600.0


Report = Callable[[float, Swarm, World], None]
"""Called every ten seconds of flight with its time, the swarm and the world."""


def endurance_s(mission: Mission) -> list[float]:
    """How long each stub vehicle can fly: as the mission says, or twice the search with its ways out and home."""
    return [v.endurance_s or 2.0 * (mission.duration_s + STUB_RESERVE_S) for v in mission.fleet]


def autopilots(mission: Mission) -> list[str]:
    """Which firmware each stub vehicle plays."""
    return [mission.stub.autopilot if v.autopilot == "auto" else v.autopilot for v in mission.fleet]


def warm_up(mission: Mission, algorithm: str) -> bool:
    """Compile, or load, every kernel a flight calls; returns whether they had to be compiled."""
    first_time = not bind.is_compiled(algorithm)
    world = Scenario(mission, ideal=False).world(0, algorithm)
    world.prepare()
    for stage in (world.observe, world.share, world.deliver, world.decide):
        stage(0)
    world.orders[:] = 1
    world.begin_return(0.0)
    world.steer(0.0)
    calls.read_poses(np.zeros((len(world.fleet), len(COLUMNS))), world.poses, 0.0, 0.0, 0.0)
    return first_time


def fly(
    mission: Mission,
    seed: int,
    folder: RunFolder,
    make_vehicles: Callable[[Mission, World], Vehicles],
    orders: Orders,
    report: Report,
) -> Outcome:
    """Fly ``mission`` in lockstep and record it.  Raises FlightError, RunFolderError."""
    scenario = Scenario(mission, ideal=False)
    world = scenario.world(seed)
    interval = 1.0 / mission.setpoints.rate_hz
    settings = session_settings(mission)
    sessions = [Session(i + 1, settings=settings, now=0.0) for i in range(len(world.fleet))]
    vehicles = make_vehicles(mission, world)
    text = f"# Flown with --seed {seed}.\n" + dump(mission)
    folder.write_text(folder.mission, text)
    journal = Journal(folder, world, text, about_flight(mission, world, seed))
    try:
        swarm = Swarm(mission, world, sessions, journal, Preparation(mission, sessions, now=0.0))
        track = Track(len(sessions))
        lockstep = Lockstep(swarm, sessions, vehicles, journal, track, interval, mission.duration_s)
        began = clock.wall_s()
        lockstep.run(obey_and_report(swarm, world, orders, report))
    finally:
        journal.close()
    wall = clock.wall_s() - began
    return Outcome(mission, world, scenario.regions, swarm, sessions, track, seed, wall, orders.level > 0)


def session_settings(mission: Mission) -> SessionSettings:
    """What the mission says of links and rates."""
    rate = mission.setpoints.rate_hz
    return SessionSettings(rate_hz=rate, setpoint_rate_hz=rate, link_loss_s=mission.safety.link_loss_s)


def about_flight(mission: Mission, world: World, seed: int) -> dict[str, str]:
    """What a recording says of itself."""
    endurance = " ".join(f"{s:g}" for s in endurance_s(mission))
    return {
        "algorithm": world.algorithm,
        "seed": str(seed),
        "version": __version__,
        "endurance_s": endurance,
        "autopilots": " ".join(autopilots(mission)),
        "wind_mps": " ".join(f"{w:g}" for w in mission.stub.wind_mps),
    }


def obey_and_report(
    swarm: Swarm, world: World, orders: Orders, report: Report, every_s: float = REPORT_EVERY_S,
    may_stop: bool = True,
) -> Callable[[float], None]:  # fmt: skip
    """Obey the operator, and report every ``every_s`` of flight time.

    ``may_stop``: a third Ctrl-C stops the program at once, which raises StoppedError.  Real vehicles are never
    left in the air by that.
    """
    due = 0.0

    def each_tick(now: float) -> None:
        nonlocal due
        if orders.level > orders.obeyed:
            orders.obeyed = orders.level
            if orders.level > 2 and may_stop:
                raise StoppedError(
                    "stopped at once, not everybody down; the recording ends here (replay reads it)"
                )
            if orders.level == 1:
                swarm.return_all("ordered by the operator", now)
            else:
                swarm.land_all(now)
        if now >= due or swarm.part is Part.OVER:
            due = now + every_s
            report(now, swarm, world)

    return each_tick


def write_results(outcome: Outcome, folder: RunFolder) -> dict[str, object]:
    """Write summary.json and tracks.png; returns the summary."""
    summary = outcome.summary(str(folder.path))
    folder.write_json(folder.summary, summary)
    draw(folder.tracks, picture(outcome))
    return summary


def picture(outcome: Outcome) -> Picture:
    """What tracks.png shows of a flight."""
    targets, found_s = outcome.world.scene.targets, outcome.found_s
    ordered = np.sort(found_s[np.isfinite(found_s)])
    count = max(len(found_s), 1)
    east, north = outcome.track.field("east"), outcome.track.field("north")
    airborne = outcome.track.airborne
    searching = outcome.track.times_s < outcome.search_window_s[1]
    places = np.stack((east, north), axis=2)
    vehicles = range(east.shape[1])
    tracks = [places[airborne[:, i] & searching, i] for i in vehicles]
    returns = [places[airborne[:, i] & ~searching, i] for i in vehicles]
    times = np.concatenate(([0.0], ordered, [outcome.searched_s]))
    fraction = np.concatenate(([0.0], np.arange(1, len(ordered) + 1) / count, [len(ordered) / count]))
    return Picture(
        algorithm=outcome.world.algorithm,
        border=outcome.regions.border,
        keep_outs=outcome.regions.keep_outs,
        targets=np.column_stack((targets["east"], targets["north"])),
        found=np.isfinite(found_s),
        tracks=tracks,
        times_s=times,
        fraction=fraction,
        crossings=outcome.summary("")["time_to_s"],
        duration_s=max(outcome.searched_s, 1.0),
        subtitle=subtitle_of(outcome.mission, outcome.seed),
        returns=returns,
    )


def default_folder(out: Path | None, algorithm: str) -> RunFolder:
    """The run's folder: ``out``, or one named by the time."""
    return RunFolder.create(out, algorithm=algorithm, now=clock.today())
