"""The stages of one vehicle's flight, in order; a vehicle is airborne from TAKE_OFF to LAND, and from ADRIFT on."""

from .jit import kernel

GROUND = 0
TAKE_OFF = 1  # climbing from its pad
HOLD = 2  # up, waiting at the barrier for the others
SEARCH = 3  # following its planner
WAIT = 4  # ordered home, or stuck: hovering until it is time and the way up to its height layer is clear
CLIMB = 5  # on the way to its layer
TRANSIT = 6  # on its route
OVER_PAD = 7  # hovering over its pad until the way down is clear
DESCEND = 8  # on the way down, layer by layer
LAND = 9  # low over its pad, landing
LANDED = 10
ADRIFT = 11  # in the air and not ours any more: failed, released or silent; an obstacle to the others
TAKEN = 12  # taken back wherever it was: keeps its height until it is clear of others
LEVEL = 13  # changing to its search height, in a column that it has claimed; then it holds

NAMES = (
    "ground", "take-off", "hold", "search", "wait", "climb", "transit", "over pad", "descend", "land", "landed",
    "adrift", "taken", "level",
)  # fmt: skip


@kernel
def airborne(stage: int) -> bool:
    """Whether a vehicle at this stage is in the air."""
    return TAKE_OFF <= stage <= LAND or stage >= ADRIFT


@kernel
def guarded(stage: int) -> bool:
    """Whether the guard has the last word on what a vehicle at this stage is told."""
    return SEARCH <= stage <= LAND or stage >= TAKEN


@kernel
def changes_height(stage: int) -> bool:
    """Whether a vehicle at this stage may pass the heights of others, and so looks at everybody's path."""
    return WAIT <= stage <= LAND or stage >= TAKEN
