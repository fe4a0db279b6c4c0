"""The planners: one module an algorithm, and the registry of their names.

A planner module has TITLE, PARAMETERS, MEMORY (a dtype that begins with the common fields), LISTS (whether
beacons carry lists of contacts: whether it has a use for what others saw) and three kernels:
``start`` prepares a memory, ``tell`` fills the planner's part of the beacon, ``step`` plans one period.  One that
tells more than every beacon carries has its own BEACON too (a dtype that begins with state.BEACON's fields).
"""

from importlib import import_module
from types import ModuleType

MODULES = {
    "mdc": "mdc",
    "fco": "fco",
    "ace": "ace",
    "dpso-u": "dpso_u",
    "belief": "belief",
    "bounce": "bounce",
    "levy": "levy",
    "sweep": "sweep",
}


def module(name: str) -> ModuleType:
    """The module of algorithm ``name``; KeyError for an unknown one."""
    return import_module(f"{__name__}.{MODULES[name]}")


def limits() -> dict[str, dict[str, tuple[float, float]]]:
    """Every algorithm with its parameters' least and greatest values; those that are choices have none."""
    return {
        name: {p.name: (p.low, p.high) for p in module(name).PARAMETERS if not p.choices} for name in MODULES
    }


def choices() -> dict[str, dict[str, tuple[str, ...]]]:
    """Every algorithm with the words that its parameters can be, where they are no numbers."""
    return {name: {p.name: p.choices for p in module(name).PARAMETERS if p.choices} for name in MODULES}


def catalogue() -> dict[str, dict[str, float | str]]:
    """Every algorithm with its parameters' defaults."""
    return {name: {p.name: p.default for p in module(name).PARAMETERS} for name in MODULES}
