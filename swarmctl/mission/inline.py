"""The files that a mission names, read and written into it, so that it stands on its own.

An area's file becomes ``polygon_m`` and further keep-outs, a targets' file ``positions_m``; what is found
wrong with them later is traced back to the key that named the file.
"""

from pathlib import Path

import numpy as np

from . import areas, geometry
from .errors import Finding, KeyPath
from .geometry import Floats
from .model import FARTHEST_M, Area, Circle, KeepOut, Mission, Origin, PolygonM, Targets


class FileError(Exception):
    """A file that cannot be read, or not be used; the text says why."""


def inline(mission: Mission, folder: Path) -> tuple[Mission, list[Finding]]:
    """The mission with its files' contents in place, and what is wrong with the files.

    Files are looked for from ``folder``, where the mission's own file lies.
    """
    findings = []
    if mission.area.file is not None:
        try:
            mission = _with_area(mission, mission.area.file, folder)
        except (areas.AreaError, FileError) as fault:
            findings.append(_finding("area", mission.area.file, fault))
    if mission.targets.file is not None:
        try:
            mission = _with_targets(mission, mission.targets.file, folder)
        except (areas.AreaError, FileError) as fault:
            findings.append(_finding("targets", mission.targets.file, fault))
    findings.extend(_miscounted(mission.targets))
    return _counted(mission), findings


def named_by(path: KeyPath, written: Mission) -> KeyPath:
    """The key in the mission as ``written`` that is the source of ``path`` in the mission inlined."""
    from_file = path[0] == "keep_out" and len(path) > 1 and int(path[1]) >= len(written.keep_out)
    if written.area.file is not None and (path[0] == "area" or from_file):
        return ("area", "file")
    if written.targets.file is not None and path[:2] == ("targets", "positions_m"):
        return ("targets", "file")
    return path


def read_limited(path: Path, limit: int) -> bytes:
    """A file's bytes, or a few more than ``limit`` of them.  Raises FileError."""
    try:
        with path.open("rb") as file:
            return file.read(limit + 1)
    except FileNotFoundError:
        raise FileError("there is no such file") from None
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise FileError(f"cannot be read: {reason.lower()}") from None


def _finding(section: str, file: str | None, fault: Exception) -> Finding:
    hint = "files are looked for beside the mission's own" if isinstance(fault, FileError) else ""
    return Finding((section, "file"), f"{file!a} {fault}", hint)


def _with_area(mission: Mission, file: str, folder: Path) -> Mission:
    outline = areas.read_outline(file, read_limited(folder / file, areas.MAX_BYTES))
    origin = mission.origin
    border = (
        _polygon(geometry.local_m(tuple(outline.borders[0]), origin))
        if outline.borders
        else _polygon(geometry.circle_m(_circle(outline.border_circles[0], origin), within=True))
    )
    keep_outs = [
        *(KeepOut(polygon_m=_polygon(geometry.local_m(tuple(ring), origin))) for ring in outline.keep_outs),
        *(KeepOut(circle_m=_circle(circle, origin)) for circle in outline.circles),
    ]
    return mission.model_copy(
        update={"area": Area(polygon_m=border), "keep_out": mission.keep_out + tuple(keep_outs)}
    )


def _with_targets(mission: Mission, file: str, folder: Path) -> Mission:
    points = areas.read_points(read_limited(folder / file, areas.MAX_BYTES))
    positions = _polygon(geometry.local_m(tuple(points), mission.origin))
    targets = mission.targets.model_copy(update={"file": None, "positions_m": positions})
    return mission.model_copy(update={"targets": targets})


def _polygon(points: Floats) -> PolygonM:
    far = float(np.abs(points).max())
    if far > FARTHEST_M:
        raise FileError(
            f"reaches {far / 1000:.0f} km from the origin, at most {FARTHEST_M / 1000:.0f} are allowed"
        )
    return tuple((float(east), float(north)) for east, north in points)


def _circle(circle: tuple[float, float, float], origin: Origin) -> Circle:
    lat, lon, radius = circle
    return Circle(center_m=_polygon(geometry.local_m(((lat, lon),), origin))[0], radius_m=radius)


def _miscounted(targets: Targets) -> list[Finding]:
    positions = targets.positions_m
    if positions is None or "count" not in targets.model_fields_set or targets.count == len(positions):
        return []
    return [
        Finding(("targets", "count"), f"{targets.count}, but {len(positions)} are placed", "leave count out")
    ]


def _counted(mission: Mission) -> Mission:
    if mission.targets.positions_m is None:
        return mission
    targets = mission.targets.model_copy(update={"count": len(mission.targets.positions_m)})
    return mission.model_copy(update={"targets": targets})
