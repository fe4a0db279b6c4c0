"""The same density for more or fewer vehicles: what of a mission grows with them."""

import math

from .errors import COMMAND_LINE, MissionError, Problem
from .model import Mission, VehicleGroup


def at_constant_density(mission: Mission, vehicles: int) -> dict[str, object]:
    """Settings that make of ``mission`` one for ``vehicles`` at its own density, to be laid over its file.

    The area grows with the vehicles, and with it the numbers of clusters and targets; vehicles start spread over
    it, since from one corner a large area would never fill.  Keep-outs stay as drawn.  Raises MissionError for a
    mission with an area that is no rectangle, targets of its own, or vehicles listed one by one.
    """
    if mission.area.size_m is None:
        raise _refusal("area", "can grow only if it is given as size_m")
    if mission.targets.positions_m is not None:
        raise _refusal("targets", "cannot grow in number: the mission says where they are")
    if not isinstance(mission.vehicles, VehicleGroup):
        raise _refusal("vehicles", "cannot grow in number: the mission lists them one by one")
    share = vehicles / mission.vehicles.count
    width, height = (side * math.sqrt(share) for side in mission.area.size_m)
    return {
        "area.size_m": [round(width, 3), round(height, 3)],
        "targets.clusters": max(1, round(mission.targets.clusters * share)),
        "targets.count": round(mission.targets.count * share),
        "vehicles.count": vehicles,
        "vehicles.launch": "spread",
    }


def _refusal(key: str, why: str) -> MissionError:
    return MissionError([Problem(COMMAND_LINE, None, None, key, why, "leave --constant-density out")])
