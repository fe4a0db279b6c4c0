"""A planner's parameter: its name, default, meaning, and where it comes from.

Kernels know numbers only.  A parameter that is a choice between words has its word's place among ``choices``.
"""

from typing import NamedTuple


class Parameter(NamedTuple):
    """One number a planner can be set with, from ``low`` to ``high``, or one of ``choices``, where there are any.

    ``source``: the paper's equation, or "ours".  ``search`` is the range that ``swarmctl tune`` looks in, where values
    make sense rather than merely work; None: tuning leaves it alone.
    """

    name: str
    default: float | str
    meaning: str
    source: str
    low: float = 0.0
    high: float = 1e6
    search: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()

    def number(self, value: float | str) -> float:
        """The value as kernels take it; ValueError for a word that is no choice."""
        return float(self.choices.index(str(value)) if self.choices else value)
