"""tracks.png once more, from the recording alone."""

from pathlib import Path

import numpy as np

from swarmctl.core import stages, state
from swarmctl.mission.geometry import regions
from swarmctl.mission.load import load

from . import mcap_read, rows
from .folder import RunFolder
from .replay import as_now, open_world
from .searched import CONTINUES, searched
from .summary import time_to
from .tracks import Picture, draw, subtitle_of


def redraw(folder: RunFolder) -> Path:
    """Draw the run's tracks as its telemetry told them.  Raises RecordError, MissionError."""
    mission = load(folder.mission)
    area = regions(mission)
    log = mcap_read.read(folder.mcap)
    world = open_world(log)
    period = float(world.rules[0]["period"])
    targets = world.scene.targets
    first = searched(log, len(world.fleet), len(targets)).found
    found = np.where(first < 0, np.inf, first * period)
    places: list[list[tuple[float, float]]] = [[] for _ in world.fleet]
    homeward: list[list[tuple[float, float]]] = [[] for _ in world.fleet]
    ticks = int(log.metadata.get(CONTINUES, {}).get("ticks", "0"))
    for message in log.rows("/observations", "/ticks"):
        if message.topic == "/observations":
            ticks = message.tick + 1
            continue
        for i, row in enumerate(as_now(message.rows, rows.TICK, "/ticks")):
            if stages.airborne(row["stage"]) and row["stage"] != stages.ADRIFT:
                part = homeward if stages.WAIT <= row["stage"] <= stages.LAND else places
                part[i].append((row["east"], row["north"]))
    ordered = np.sort(found[np.isfinite(found)])
    count = max(len(targets), 1)
    assert state.TARGET.names
    picture = Picture(
        algorithm=world.algorithm,
        border=area.border,
        keep_outs=area.keep_outs,
        targets=np.column_stack((targets["east"], targets["north"])),
        found=np.isfinite(found),
        tracks=[np.array(p).reshape(-1, 2) for p in places],
        times_s=np.concatenate(([0.0], ordered, [ticks * period])),
        fraction=np.concatenate(([0.0], np.arange(1, len(ordered) + 1), [len(ordered)])) / count,
        crossings=time_to(found),
        duration_s=max(ticks * period, 1.0),
        returns=[np.array(p).reshape(-1, 2) for p in homeward],
        subtitle=subtitle_of(mission, int(world.rules[0]["seed"])),
    )
    draw(folder.tracks, picture)
    return folder.tracks
