"""The records that stages pass on: what one vehicle is, senses, knows, hears, wants and may do.

Every field is eight bytes wide, so a record is packed and aligned alike, and its bytes are what the run's
log holds (ROS 1 serialisation of fixed-size fields is exactly these bytes).  Arrays of records have one row
a vehicle.  Metres, seconds, east-north-up about the mission's origin, unless the name says otherwise.
"""

from collections.abc import Sequence

import numpy as np


def record(*fields: str | tuple[str, int], integers: Sequence[str] = ()) -> np.dtype[np.void]:
    """A packed dtype of float64 fields; those named in ``integers`` are int64, ``(name, n)`` is a row of n."""
    columns = []
    for field in fields:
        name, size = field if isinstance(field, tuple) else (field, 1)
        kind = "<i8" if name in integers else "<f8"
        columns.append((name, kind) if size == 1 else (name, kind, (size,)))
    return np.dtype(columns)


# What a vehicle is, from the mission and its adapter.
VEHICLE = record(
    "speed", "acceleration", "braking", "lag", "latency", "climb", "descent", "climb_acceleration",
    "altitude", "pad_east", "pad_north", "heading_east", "heading_north",
    "sensor_range", "detection_probability", "alarms_per_second", "position_noise", "radio_range", "radio_loss",
    "beacon_contacts",
    integers=("beacon_contacts",),
)  # fmt: skip

# What holds for the whole run.  `wire`: a study sees what messages carry (core/wire.py), about the mission's
# origin (degrees, m); `wind` (m/s) is what its multicopters fly in.
RULES = record(
    "seed", "period", "interval", "separation", "duration", "metric", "ideal", "radio_delay",
    "alarm_slots", "targets", "landing_speed", "wire", "origin_lat", "origin_lon", "origin_alt", "wind_east",
    "wind_north",
    integers=("seed", "metric", "ideal", "radio_delay", "alarm_slots", "targets", "wire"),
)  # fmt: skip

# Where a vehicle is and how it moves: true, or as telemetry tells.
POSE = record("east", "north", "up", "v_east", "v_north", "v_up")

# One thing reported by a sensor or a neighbour: serial number and place.
CONTACT = record("id", "east", "north", integers=("id",))

# What a vehicle knows, beside its list of contacts: `before` entries of them were known a period ago,
# `seen` of this period's new ones came from its own sensor (they come first), the rest by radio.
KNOWLEDGE = record(
    "known",
    "before",
    "seen",
    "in_range",
    "cursor",
    integers=("known", "before", "seen", "in_range", "cursor"),
)

# What a vehicle tells: itself, its planner's best, and entries [first, last) of its contact list.
BEACON = record(
    "east", "north", "v_east", "v_north", "in_range", "on_visit", "best", "best_east", "best_north",
    "first", "last",
    integers=("in_range", "on_visit", "best", "first", "last"),
)  # fmt: skip

# What every planner remembers; a planner's own memory begins with these fields.  `clear` is a circle that no fence
# reaches into (planners/common.py).
COMMON_MEMORY = ("heading_east", "heading_north", "throttle", "clear_east", "clear_north", "clear_radius")

# What a planner wants for the coming period: a velocity.
WISH = record("v_east", "v_north")

# What the flight wants of a vehicle at a setpoint tick, before the guard: the planner's wish, or the way home.
WANT = record("v_east", "v_north", "up")

# What was told to the vehicle and how its guard came to it; `outcome` is one of guard.OUTCOMES.
SETPOINT = record("v_east", "v_north", "up", "outcome", integers=("outcome",))

# The stop path a vehicle owns: here, where it will be after latency and interval, where it then stands;
# `low` and `high` bound the heights it may pass, and `reach` (m) is no less than its length.
# From `anchor_east` on: the vehicle's anchor (core/anchor.py).
PATH = record(
    "east_0", "north_0", "east_1", "north_1", "east_2", "north_2", "low", "high", "reach", "airborne",
    "anchor_east", "anchor_north", "freedom", "fastest", "hold", "clear", "near",
    integers=("airborne", "near"),
)  # fmt: skip

ROUTE_POINTS = 24
# A vehicle's stage of the flight (core/stages.py) and its way home.
ERRAND = record(
    "stage", "points", "next", "layer", "wait_up", "release_at", "progress_at", "closest",
    ("route_east", ROUTE_POINTS), ("route_north", ROUTE_POINTS),
    integers=("stage", "points", "next"),
)  # fmt: skip

# One target: where it lies, or about where it moves (core/roam.py), and its cluster.
TARGET = record("east", "north", "cluster", integers=("cluster",))

# The grid that the targets, sorted by cell, are found through, and how they move.  Whoever sees no further than
# `block` cells sees nothing where there are no targets so many cells around.  `stray` is how far from its place in
# TARGET a target can be at most: 0 where nothing moves.  Where clusters drift there is one row a cluster, for its
# way (a unit vector, and how many metres ahead and behind it goes); all else is read from the first row.
GRID = record(
    "east", "north", "cell", "columns", "rows", "block", "seed", "stray", "wander", "wander_speed",
    "drift_speed", "way_east", "way_north", "ahead", "behind",
    integers=("columns", "rows", "block", "seed"),
)  # fmt: skip
