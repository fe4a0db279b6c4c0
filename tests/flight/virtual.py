"""The live flight's own code against stub vehicles in virtual time: an event loop that never waits.

Time jumps to the next deadline when there is nothing to do, so that an hour of flight takes seconds and every
run is the same run.  Between controller and stubs are the vehicles' own bad networks, if a test wants them.
"""

import asyncio
import math
import selectors
import shutil
from collections.abc import Callable, Coroutine, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any, TypeVar

from sim_vehicle_stub.faults import parse_order
from sim_vehicle_stub.fleet import StubFleet
from swarmctl.core.world import World
from swarmctl.flight import resumption
from swarmctl.flight.fly_live import LiveOptions, fly_live
from swarmctl.flight.orders import Orders
from swarmctl.flight.results import Outcome
from swarmctl.flight.swarm import Swarm
from swarmctl.mavlink.codec import Decoder
from swarmctl.mission.launch import as_found
from swarmctl.record.folder import RunFolder
from swarmctl.vehicle.addresses import Address

from .flown import ORIGIN, small_mission

T = TypeVar("T")
STEP_S = 0.05
LONGEST_S = 3600.0
"""Virtual seconds after which a flight that has not ended has failed."""
SLOW_MPS = 10.0
"""Bare stubs have their firmware's own limits, and no more may be asked of them."""
PLACES_M = ((60.0, 60.0), (100.0, 60.0), (60.0, 100.0))
ANYWHERE = Address("udpin", "127.0.0.1", 14540)


class _Jumping(selectors.DefaultSelector):
    """Looks at real files without waiting; if nothing is there, time passes instead."""

    now = 0.0

    def select(self, timeout: float | None = None) -> list[Any]:
        ready = super().select(0.0)
        if not ready and timeout:
            self.now += timeout
        return ready


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop on virtual time, from 0."""

    def __init__(self, selector: Any = None) -> None:
        self._selector_with_time = selector or _Jumping()
        super().__init__(self._selector_with_time)

    def time(self) -> float:
        """Seconds."""
        now: float = self._selector_with_time.now
        return now

    def stand_still(self, seconds: float) -> None:
        """Time passes, and nobody here notices."""
        self._selector_with_time.now += seconds


def run(work: Coroutine[Any, Any, T], loop: Callable[[], VirtualLoop] = VirtualLoop) -> T:
    """Run ``work`` to its end in virtual time."""
    with asyncio.Runner(loop_factory=loop) as runner:
        return runner.run(work)


class StubWires:
    """The switchboard's place, with stub vehicles at the other end; ``addresses``: where each is heard.

    ``since_s``: the fleet's time when the controller's began.  ``dead``: the controller was killed.
    """

    def __init__(
        self, fleet: StubFleet, addresses: Sequence[Address] | None = None, since_s: float = 0.0
    ) -> None:
        self.fleet = fleet
        self.since_s = since_s
        self.dead = False
        self.each_step: Callable[[float], None] = lambda now: None
        self._addresses = addresses or [ANYWHERE] * len(fleet.vehicles)
        self._heard: set[int] = set()
        self._decoders = {vehicle.system: Decoder() for vehicle in fleet.vehicles}
        self._deliver: Callable[[int, bytes], None] = lambda system, data: None
        self._task: asyncio.Task[None] | None = None

    @property
    def heard(self) -> list[int]:
        """System ids of those that spoke."""
        return sorted(self._heard)

    async def open(self, addresses: list[Address]) -> None:
        """Switch the vehicles on."""
        self._task = asyncio.create_task(self._play())

    def subscribe(self, deliver: Callable[[int, bytes], None]) -> None:
        """Hand the bytes on from now on."""
        self._deliver = deliver

    def address(self, system: int) -> Address:
        """Where it is."""
        return self._addresses[system - 1]

    def complaint(self) -> str:
        """Nobody minds signatures here."""
        return ""

    def way(self, system: int) -> str:
        """The same, for people."""
        return str(self.address(system))

    def send(self, system: int, frame: bytes) -> None:
        """To a vehicle."""
        if not self.dead:
            self.fleet.vehicles[system - 1].receive(frame, self.since_s + asyncio.get_running_loop().time())

    def call(self, frame: bytes) -> None:
        """To all."""
        for vehicle in self.fleet.vehicles:
            self.send(vehicle.system, frame)

    def close(self) -> None:
        """The controller is gone: the vehicles fly on, but nobody looks."""
        assert self._task is not None
        self._task.cancel()

    async def _play(self) -> None:
        loop = asyncio.get_running_loop()
        k = 0
        while True:
            k += 1
            await asyncio.sleep(max(0.0, k * STEP_S - loop.time()))
            self.each_step(loop.time())
            self.fleet.advance(self.since_s + loop.time())
            for vehicle in self.fleet.vehicles:
                for data in vehicle.outgoing():
                    self.leaves(vehicle.system, data)

    def leaves(self, system: int, data: bytes) -> None:
        """A vehicle has sent something, which is here at once."""
        if any(True for _ in self._decoders[system].feed(data)):
            self._heard.add(system)
        self._deliver(system, data)

    def stop_controller(self, seconds: float, kept: int = 10_000) -> None:
        """The vehicles fly on; of what each says meanwhile, the first ``kept`` frames wait to be read."""
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        waiting: dict[int, list[bytes]] = {vehicle.system: [] for vehicle in self.fleet.vehicles}
        for _ in range(round(seconds / STEP_S)):
            loop.stand_still(STEP_S)
            self.fleet.advance(loop.time())
            for vehicle in self.fleet.vehicles:
                waiting[vehicle.system] += vehicle.outgoing()
        for system, frames in waiting.items():
            for data in frames[:kept]:
                self._deliver(system, data)


@dataclass
class Live:
    """A live flight to be flown in virtual time: its vehicles, and what is done to it.

    ``at``: (time in s, deed with the swarm, or None before there is one).  ``faults`` as on the stub's command line.
    ``options``: of LiveOptions, and ``heard_on`` (each vehicle's address) and ``make_wires``; ``stubs``: of StubFleet.
    """

    path: Path
    settings: dict[str, object] = field(default_factory=dict)
    autopilots: Sequence[str] = ("px4", "px4", "px4")
    places_m: Sequence[tuple[float, float]] = PLACES_M
    faults: Sequence[str] = ()
    at: list[tuple[float, Callable[["Live"], None]]] = field(default_factory=list)
    seed: int | None = 5
    options: dict[str, Any] = field(default_factory=dict)
    stubs: dict[str, Any] = field(default_factory=dict)
    loop: Callable[[], VirtualLoop] = VirtualLoop
    swarm: Swarm | None = None
    orders: Orders = field(default_factory=Orders)
    now: float = 0.0
    fleet_s: float = 0.0
    nearest_m: float = math.inf  #: how near two vehicles in the air at one height truly came

    def __post_init__(self) -> None:
        self.fleet = StubFleet(
            len(self.autopilots),
            origin=ORIGIN,
            pads_m=self.places_m,
            autopilot=self.autopilots,
            seed=self.seed,
            **self.stubs,
        )
        for fault in self.faults:
            self.fleet.order(parse_order(fault))
        make_wires = self.options.pop("make_wires", StubWires)
        self.wires: StubWires = make_wires(self.fleet, self.options.pop("heard_on", None))
        self.wires.each_step = self._step
        self.folder = RunFolder(self.path / "run")

    def impair(self, **impairments: Any) -> None:
        """Make every vehicle's link bad."""
        for vehicle in self.fleet.vehicles:
            vehicle.network.impair(**impairments)

    @property
    def down(self) -> list[bool]:
        """Who truly stands on the ground with its motors off."""
        return [bool(v.landed and not v.armed) for v in self.fleet.vehicles]

    def fly(self) -> Outcome:
        """Fly it to its end.  Raises what the flight raises, TimeoutError if it does not end."""
        mission = as_found(
            small_mission(
                self.path,
                {"vehicles.count": len(self.autopilots), "vehicles.speed_mps": SLOW_MPS, **self.settings},
            )
        )
        self.folder.path.mkdir()
        options = LiveOptions(
            **{
                "addresses": [[ANYWHERE]] * len(self.autopilots),
                "wires": lambda signing: self.wires,
                **self.options,
            }
        )

        flight = fly_live(mission, 1, self.folder, options, self.orders, self._report)
        return run(asyncio.wait_for(flight, LONGEST_S), self.loop)

    def die(self) -> Path:
        """Kill the controller now, and let what was on disk by then be all that it leaves: in that folder."""
        left = self.path / "killed"
        shutil.copytree(self.folder.path, left)
        self.wires.dead = True
        asyncio.get_running_loop().stop()
        return left

    def forsake(self, seconds: float) -> None:
        """The vehicles fly on, nobody speaks to them."""
        for _ in range(round(seconds / STEP_S)):
            self.fleet_s += STEP_S
            self.fleet.advance(self.fleet_s)
            for vehicle in self.fleet.vehicles:
                vehicle.outgoing()

    def resume(self, run_folder: Path, name: str = "resumed", **options: Any) -> Outcome:
        """Fly on what was killed, into a folder of that name, to its end."""
        before = resumption.read(run_folder)
        self.wires = StubWires(self.fleet, since_s=self.fleet_s)
        self.wires.each_step = self._step
        self.folder = RunFolder(self.path / name)
        self.folder.path.mkdir()
        self.orders = Orders()
        wanted = LiveOptions(
            [[address] for address in before.addresses],
            wires=lambda signing: self.wires,
            resumes=before,
            **options,
        )
        flight = fly_live(before.mission, before.seed, self.folder, wanted, self.orders, self._report)
        return run(asyncio.wait_for(flight, LONGEST_S))

    def _report(self, now: float, swarm: Swarm, world: World) -> None:
        self.swarm = swarm

    def _step(self, now: float) -> None:
        self.now = now
        self.fleet_s = self.wires.since_s + now
        self._measure()
        while self.at and self.at[0][0] <= now:
            self.at.pop(0)[1](self)

    def _measure(self) -> None:
        aloft = [body for body in self.fleet.truth if body["up"] > 0.5]
        for one, other in combinations(aloft, 2):
            if abs(one["up"] - other["up"]) < 5.0:
                apart = math.hypot(one["east"] - other["east"], one["north"] - other["north"])
                self.nearest_m = min(self.nearest_m, apart)


def outcomes(outcome: Outcome) -> list[str]:
    """How each vehicle ended."""
    return [v["outcome"] for v in outcome.summary("")["per_vehicle"]]


def events(outcome: Outcome, system: int) -> str:
    """What is told of one vehicle."""
    return "\n".join(outcome.summary("")["per_vehicle"][system - 1]["events"])
