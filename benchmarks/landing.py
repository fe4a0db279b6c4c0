"""How soon is a swarm down after its search?  Whole returns in the compiled loop, watched at every setpoint tick.

    python benchmarks/landing.py [--vehicles 6,16,41,60,100] [--algos fco,bounce,mdc,sweep] [--seeds 4]
                                 [--speed 12] [--search 120] [--separation 15] [--packaged]

The swarm stands on pads 20 m apart in the south-west corner of 1000 x 1000 m with two keep-outs, searches at 30 m
and returns; --packaged flies the packaged missions instead, as they are but for a search of 300 s at most.  Each
line is the worst of all seeds.  Printed, in seconds from the search's end: the last landing, what the farthest
vehicle would need alone at best (straight home at full speed, down to 10 m at full rate, down to the ground at the
landing rate; starting, braking and disarming not counted), and the mean landing; then the greatest height above
the highest search height, the nearest two airborne vehicles came at one height (m), vehicle-ticks outside the
keep-in or inside a keep-out, and vehicles that were not down after 1200 s.
"""

import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple, dataclass

import numpy as np

from swarmctl.core import bind, homing, stages, steering
from swarmctl.core.world import World
from swarmctl.mission.load import load, packaged
from swarmctl.mission.model import Mission
from swarmctl.mission.scenario import Scenario

MOST_S = 1200.0
KEEP_OUTS = [{"box_m": [420, 520, 380, 620]}, {"circle_m": {"center_m": [700, 260], "radius_m": 60}}]
SWARM: dict[str, object] = {
    "area.size_m": [1000, 1000], "vehicles.altitude_m": 30, "sensor.range_m": 60, "radio.range_m": 300,
    "targets.clusters": 6, "targets.count": 200, "targets.radius_m": 60, "keep_out": KEEP_OUTS,
}  # fmt: skip
HEADER = (
    f"{'':8}{'':>5}{'last':>7}{'bound':>7}{'mean':>7}{'above':>7}{'nearest':>9}{'outside':>9}{'not down':>9}"
)

move, watch = bind.compiled(steering.move), bind.compiled(steering.watch)


@dataclass
class Landing:
    """What one return came to; times in seconds from the order to return."""

    last_s: float
    bound_s: float
    mean_s: float
    above_m: float
    nearest_m: float
    outside: float
    not_down: int


def search(world: World, account: np.ndarray) -> float:
    """Take off and search to the end; returns the time."""
    world.errands["stage"] = stages.TAKE_OFF
    rules = world.rules[0]
    k = 0
    while (world.errands["stage"] != stages.HOLD).any():
        k = step(world, k, account)
    world.errands["stage"] = stages.SEARCH
    world.prepare()
    per_period = round(rules["period"] / rules["interval"])
    for tick in range(round(rules["duration"] / rules["period"])):
        world.observe(tick)
        world.share(tick)
        world.deliver(tick)
        world.decide(tick)
        for _ in range(per_period):
            k = step(world, k, account)
    return k * float(rules["interval"])


def step(world: World, k: int, account: np.ndarray) -> int:
    """One setpoint tick; returns the next one's number."""
    world.steer(k * float(world.rules[0]["interval"]))
    move(world.fleet, world.poses, world.errands, world.sent, world.setpoints, world.rules)
    watch(world.poses, world.errands, world.fences.raw, world.paths, account)
    return k + 1


def bound_s(world: World) -> float:
    """The least time that the vehicle farthest from its pad needs."""
    fleet, poses = world.fleet, world.poses
    way = np.hypot(poses["east"] - fleet["pad_east"], poses["north"] - fleet["pad_north"])
    sinking = np.maximum(poses["up"] - homing.LANDING_HEIGHT_M, 0.0) / fleet["descent"]
    landing = np.minimum(poses["up"], homing.LANDING_HEIGHT_M) / world.rules[0]["landing_speed"]
    return float((way / fleet["speed"] + sinking + landing).max())


def come_home(world: World) -> Landing:
    """Search, then send everybody home and watch them land."""
    account = np.array([np.inf, 0.0, 0.0, 0.0])
    began = search(world, account)
    interval = float(world.rules[0]["interval"])
    bound, highest = bound_s(world), 0.0
    world.orders[:] = 1
    world.begin_return(began)
    landed = np.full(len(world.fleet), MOST_S)
    k = first = round(began / interval)
    while (world.errands["stage"] != stages.LANDED).any() and (k - first) * interval < MOST_S:
        k = step(world, k, account)
        highest = max(highest, float(world.poses["up"].max()))
        down = world.errands["stage"] == stages.LANDED
        landed[down] = np.minimum(landed[down], (k - first) * interval)
    not_down = int((world.errands["stage"] != stages.LANDED).sum())
    above = highest - float(world.fleet["altitude"].max())
    return Landing(
        float(landed.max()),
        bound,
        float(landed.mean()),
        above,
        float(account[0]),
        float(account[1]),
        not_down,
    )


def print_row(name: str, vehicles: int, landings: list[Landing]) -> bool:
    """The worst of one algorithm's landings; returns whether nothing was broken."""
    table = np.array([astuple(landing) for landing in landings])
    last, bound, mean, above = table[:, :4].max(axis=0)
    nearest, outside, not_down = table[:, 4].min(), table[:, 5].sum(), table[:, 6].sum()
    print(
        f"{name:8}{vehicles:5}{last:7.1f}{bound:7.1f}{mean:7.1f}{above:7.1f}{nearest:9.2f}{outside:9.0f}{not_down:9.0f}",
        flush=True,
    )
    return bool(outside == 0 and not_down == 0)


def fly(mission: Mission, algorithms: list[str], seeds: int) -> bool:
    """One line an algorithm; returns whether no limit was broken and everybody came down."""
    scenario = Scenario(mission, ideal=False)
    good = True
    with ThreadPoolExecutor(2) as pool:
        for name in algorithms:
            landings = list(
                pool.map(lambda seed, a=name: come_home(scenario.world(seed, a)), range(1, seeds + 1))
            )
            good &= print_row(name, len(mission.fleet), landings)
            good &= min(landing.nearest_m for landing in landings) >= mission.safety.separation_m
    return good


def main() -> int:
    """Print the table; exit status 1 if a limit was broken or somebody did not land."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--vehicles", default="6,16,41,60,100")
    parser.add_argument("--algos", default="fco,bounce,mdc,sweep")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--speed", type=float, default=12.0)
    parser.add_argument("--search", type=float, default=120.0)
    parser.add_argument("--separation", type=float, default=15.0)
    parser.add_argument("--packaged", action="store_true")
    arguments = parser.parse_args()
    algorithms = arguments.algos.split(",")
    good = True
    if arguments.packaged:
        for name in packaged():
            mission = load(name)
            mission = load(name, {"duration_s": min(mission.duration_s, 300.0)})
            print(f"{name}\n{HEADER}")
            good &= fly(mission, algorithms, arguments.seeds)
        return 0 if good else 1
    given = {"vehicles.speed_mps": arguments.speed, "safety.separation_m": arguments.separation}
    print(f"{arguments.speed:g} m/s, separation {arguments.separation:g} m\n{HEADER}")
    for count in arguments.vehicles.split(","):
        mission = load(None, {**SWARM, **given, "duration_s": arguments.search, "vehicles.count": int(count)})
        good &= fly(mission, algorithms, arguments.seeds)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
