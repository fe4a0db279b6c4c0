"""A planner's parameter: its name, default, meaning, and where it comes from."""

from typing import NamedTuple


class Parameter(NamedTuple):
    """One number a planner can be set with; ``source`` is the paper's equation or section, or "ours"."""

    name: str
    default: float
    meaning: str
    source: str
