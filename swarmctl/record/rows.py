"""What flight.mcap holds, topic by topic: written by the flight, read by replay, report and map.

/rules /fleet /settings /targets /fence     once, at the start: all that a replay needs of the mission
/seen             once, of a flight that continues another: which vehicle had seen which target, and when first
/observations     a planner tick: every sensor report, with the vehicle that made it
/beacons          a planner tick: what each vehicle tells
/heard            a planner tick: whose beacon reached whom (they arrive after the radio's delay)
/decisions        a planner tick: what each vehicle then knows, and the velocity it wishes
/ticks            a setpoint tick: pose, stage, want, and the guarded setpoint of each vehicle
/state            every 10 s, before a planner tick, and at the start of a flight that continues another: all memory,
                  from which replay goes on
/events           as they happen, JSON
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmctl.core import state
from swarmctl.core.world import World

Records = NDArray[Any]

OBSERVATION = np.dtype([("vehicle", "<i8"), *state.CONTACT.descr])
SEEN = np.dtype([("vehicle", "<i8"), ("target", "<i8"), ("tick", "<i8")])
HEARD = np.dtype([("receiver", "<i8"), ("sender", "<i8")])
DECISION = np.dtype([("known", "<i8"), ("before", "<i8"), ("in_range", "<i8"), *state.WISH.descr])
TICK = np.dtype(
    [
        *state.POSE.descr,
        ("stage", "<i8"),
        ("ordered_home", "<i8"),
        *((f"want_{name}", "<f8") for name in state.WANT.names or ()),
        *((f"set_{column[0]}", column[1]) for column in state.SETPOINT.descr),
    ]
)
FENCE = np.dtype([("kind", "<i8"), ("x0", "<f8"), ("y0", "<f8"), ("x1", "<f8"), ("y1", "<f8")])
FENCE_KINDS = ("raw", "plan", "guard")

STATE_S = 10.0
"""Seconds between two snapshots of all memory."""

_CARRIED = (
    "memory",
    "knowledge",
    "told",
    "beacons",
    "heard",
    "heard_count",
    "errands",
    "setpoints",
    "sent",
    "wishes",
)


def observations(world: World) -> Records:
    """This planner tick's sensor reports, flattened."""
    rows = np.zeros(int(world.report_count.sum()), OBSERVATION)
    at = 0
    for vehicle, count in enumerate(world.report_count):
        part = rows[at : at + count]
        part["vehicle"] = vehicle
        for name in state.CONTACT.names or ():
            part[name] = world.reports[vehicle, :count][name]
        at += count
    return rows


def heard(world: World, slot: int) -> Records:
    """Who will hear whom of this tick's beacons."""
    counts = world.heard_count[slot]
    rows = np.zeros(int(counts.sum()), HEARD)
    rows["receiver"] = np.repeat(np.arange(len(counts)), counts)
    if len(rows):
        rows["sender"] = np.concatenate([world.heard[slot, i, :n] for i, n in enumerate(counts)])
    return rows


def decisions(world: World) -> Records:
    """What each vehicle knows and wishes after this planner tick."""
    rows = np.zeros(len(world.fleet), DECISION)
    for name in ("known", "before", "in_range"):
        rows[name] = world.knowledge[name]
    for name in state.WISH.names or ():
        rows[name] = world.wishes[name]
    return rows


def tick_inputs(world: World, rows: Records) -> None:
    """Write poses, stages and orders as they stand before steering."""
    for name in state.POSE.names or ():
        rows[name] = world.poses[name]
    rows["stage"], rows["ordered_home"] = world.errands["stage"], world.orders


def tick_outputs(world: World, rows: Records) -> None:
    """Write wants and setpoints as they stand after steering."""
    for name in state.WANT.names or ():
        rows[f"want_{name}"] = world.wants[name]
    for name in state.SETPOINT.names or ():
        rows[f"set_{name}"] = world.setpoints[name]


def fence(world: World) -> Records:
    """The three fences' edges."""
    parts = []
    for kind, name in enumerate(FENCE_KINDS):
        edges = getattr(world.fences, name)
        rows = np.zeros(len(edges), FENCE)
        rows["kind"] = kind
        rows["x0"], rows["y0"], rows["x1"], rows["y1"] = edges.T
        parts.append(rows)
    return np.concatenate(parts)


def dump_state(world: World) -> bytes:
    """All memory of all vehicles as bytes: the carried arrays, then each vehicle's contacts."""
    parts = [getattr(world, name).tobytes() for name in _CARRIED]
    parts += [world.contacts_of(i).tobytes() for i in range(len(world.fleet))]
    return b"".join(parts)


def load_state(world: World, data: bytes) -> None:
    """Put back what :func:`dump_state` wrote.  Raises ValueError if it is of another shape."""
    at = 0
    for name in _CARRIED:
        array = getattr(world, name)
        flat = np.frombuffer(data, array.dtype, array.size, at)
        array[...] = flat.reshape(array.shape)
        at += array.nbytes
    for i in range(len(world.fleet)):
        remembered = world.contacts_of(i)
        remembered[:] = np.frombuffer(data, state.CONTACT, len(remembered), at)
        at += remembered.nbytes
    world.index()
    if at != len(data):
        raise ValueError("the snapshot is of another shape")
