"""A flight whose controller died, read from its folder so that another can fly it on.

The recording may be cut off anywhere.  What the search had come to, and all that planners and radio remember, is
as it was after the last planner tick that is whole (record/replay.py does it again from the last snapshot on); a
target whose report is on record is never lost.  The time without a controller is not search time.  How vehicles
were being steered is left behind: they are found anew, wherever they are by then.
"""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swarmctl.core.arrays import Floats
from swarmctl.core.world import World
from swarmctl.mission.load import load
from swarmctl.mission.model import Mission
from swarmctl.record import mcap_read, rows
from swarmctl.record.errors import LogError, RunFolderError
from swarmctl.record.folder import RunFolder
from swarmctl.record.mcap_read import Log
from swarmctl.record.replay import Restored, restore
from swarmctl.record.searched import CONTINUES, Searched, searched
from swarmctl.vehicle.addresses import Address, parse

from .control import is_under_way

CONTINUED = "continued"
"""The file that says in which folder a flight goes on."""
LEFT = {
    "released": "it had been released, or taken over",
    "failed": "it had failed",
    "land": "it had been told to land",
}
"""By the kind of a vehicle's last event: why it was not the swarm's any more."""
OURS_AGAIN = ("retake", "adopt", "regained")
ORDERS = ("hold", "resume", "return", "land")


@dataclass(frozen=True)
class Resumption:
    """What is flown on: ``restored`` and ``searched`` are memory and finds, ``systems`` the vehicles, row by row."""

    run: Path
    mission: Mission
    seed: int
    systems: list[int]
    addresses: list[Address]  #: where each vehicle was heard
    speed: float
    own_stubs: bool
    restored: Restored
    searched: Searched
    left: dict[int, str]  #: why a vehicle, by its row, was not the swarm's any more
    order: str  #: what the swarm was doing by order: hold, return, land, or nothing

    @property
    def pads(self) -> Floats:
        """Where the vehicles took off, (V, 2)."""
        fleet = self.restored.world.fleet
        return np.column_stack((fleet["pad_east"], fleet["pad_north"]))

    def give_back(self, world: World) -> None:
        """Put memory and finds into a new world of the same mission.  Raises RunFolderError if it is another."""
        known = self.restored.world
        if world.scene.targets.tobytes() != known.scene.targets.tobytes():
            raise RunFolderError(f"{self.run}: this version lays out other targets; use the one that flew it")
        rows.load_state(world, rows.dump_state(known))
        for steering in (world.errands, world.setpoints, world.sent):
            steering[...] = np.zeros((), steering.dtype)
        world.found[:] = self.searched.found
        world.alarms[:] = self.searched.alarms

    def note(self, folder: RunFolder) -> None:
        """From now on the flight goes on in ``folder``: nobody shall resume this one."""
        folder.write_text(self.run / CONTINUED, f"{folder.path.absolute()}\n")

    def metadata(self) -> dict[str, str]:
        """What the recording of the flight that goes on says of this one."""
        return {
            "run": str(self.run),
            "ticks": str(self.restored.ticks),
            "order": self.order,
            **self.searched.metadata(),
        }


def read(path: Path) -> Resumption:
    """Read the flight in ``path``.  Raises RecordError, MissionError, saying why it cannot be flown on."""
    if path.is_dir() and not RunFolder(path).mcap.exists():
        raise RunFolderError(f"{path}: nothing was recorded: nobody had taken off (fly the mission anew)")
    folder = RunFolder.open(path)
    if is_under_way(path):
        raise RunFolderError(f"{path}: this flight is under way (swarmctl control speaks to it)")
    if folder.summary.exists():
        raise RunFolderError(f"{path}: this flight has ended, see its summary.json (fly the mission anew)")
    _refuse_continued(path)
    log = mcap_read.read(folder.mcap)
    about = log.metadata.get("flight", {})
    if "algorithm" in about and "connect" not in about:
        raise RunFolderError(
            f"{path}: a flight in lockstep: its vehicles ended with it (fly the mission anew)"
        )
    if next(log.rows("/ticks"), None) is None:
        raise RunFolderError(f"{path}: nobody had taken off (fly the mission anew)")
    mission, restored = load(folder.mission), restore(log)
    fleet, targets = restored.world.fleet, restored.world.scene.targets
    so_far = searched(log, len(fleet), len(targets), restored.ticks)
    try:
        systems = [int(system) for system in about["systems"].split()]
        addresses = [parse(url)[0] for url in about["connect"].split()]
        seed, speed, own_stubs = int(about["seed"]), float(about["speed"]), about["own_stubs"] == "yes"
    except (KeyError, ValueError):
        raise RunFolderError(f"{path}: does not say how its vehicles were reached") from None
    if not len(systems) == len(addresses) == len(fleet) == len(mission.fleet):
        raise RunFolderError(f"{path}: its mission.yaml and its recording differ in the number of vehicles")
    left, order = _last_events(log, systems)
    return Resumption(
        path, mission, seed, systems, addresses, speed, own_stubs, restored, so_far, left, order
    )


def _refuse_continued(path: Path) -> None:
    """Whoever continued it may have died as well: then that flight is the one to go on with, if it holds anything."""
    with suppress(FileNotFoundError, LogError):
        other = Path((path / CONTINUED).read_text().strip())
        if next(mcap_read.read(other / "flight.mcap").rows("/ticks"), None) is not None:
            raise RunFolderError(f"{path}: was flown on in {other}: resume that")


def _last_events(log: Log, systems: list[int]) -> tuple[dict[int, str], str]:
    """Which rows had left the swarm, and why; and the last order to all that was still in force."""
    left: dict[int, str] = {}
    order = log.metadata.get(CONTINUES, {}).get("order", "")
    for vehicle, kind in _events(log):
        if vehicle == 0 and kind in ORDERS:
            order = "" if kind == "resume" else kind
        elif vehicle in systems and kind in LEFT:
            left[systems.index(vehicle)] = LEFT[kind]
        elif vehicle in systems and kind in OURS_AGAIN:
            left.pop(systems.index(vehicle), None)
    return left, order


def _events(log: Log) -> Iterator[tuple[int, str]]:
    """Which vehicle (0: all), and what happened."""
    for event in log.events():
        yield int(event.content.get("vehicle", 0)), str(event.content.get("kind", ""))
