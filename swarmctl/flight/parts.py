"""The parts of a flight, which the swarm as a whole goes through one after the other."""

from enum import Enum


class Part(Enum):
    """What the swarm as a whole is doing."""

    PREPARING = "preparing"
    TAKING_OFF = "taking off"
    TAKING_BACK = "taking back"  #: those of a flight whose controller died
    SEARCHING = "searching"
    RETURNING = "returning"
    WATCHING = "watching"  #: ours are down; somebody else's is still in the air
    OVER = "over"
