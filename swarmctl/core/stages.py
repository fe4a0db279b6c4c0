"""The stages of one vehicle's flight, in order; a vehicle is airborne from TAKE_OFF to LAND, and when ADRIFT."""

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

NAMES = (
    "ground", "take-off", "hold", "search", "wait", "climb", "transit", "over pad", "descend", "land", "landed",
    "adrift",
)  # fmt: skip


@kernel
def airborne(stage: int) -> bool:
    """Whether a vehicle at this stage is in the air."""
    return TAKE_OFF <= stage <= LAND or stage == ADRIFT
