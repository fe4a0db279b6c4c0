"""A planner's parameter: its name, default, meaning, and where it comes from."""

from typing import NamedTuple


class Parameter(NamedTuple):
    """One number a planner can be set with, from ``low`` to ``high``; ``source``: the paper's equation, or "ours".

    ``search`` is the range that ``swarmctl tune`` looks in, where values make sense rather than merely work; None:
    tuning leaves it alone.
    """

    name: str
    default: float
    meaning: str
    source: str
    low: float = 0.0
    high: float = 1e6
    search: tuple[float, float] | None = None
