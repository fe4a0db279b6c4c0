"""A mission written down again: the run folder's mission.yaml, complete, and needing no other file."""

from typing import Any

import yaml

from .model import Mission, VehicleGroup
from .yaml_reader import Dumper

SHAPES = ("area", "targets")
"""Sections in which a key that is not given must stay away, since it excludes another."""


def dump(mission: Mission) -> str:
    """YAML that loads back to an equal Mission; every key is written, its default or not."""
    data: dict[str, Any] = mission.model_dump(mode="json")
    for section in SHAPES:
        data[section] = _given(data[section])
    data["keep_out"] = [_given(item) for item in data["keep_out"]]
    if not isinstance(mission.vehicles, VehicleGroup):
        for entry, written in zip(mission.vehicles, data["vehicles"], strict=True):
            # Key by key: what an entry leaves out is the mission's own.
            for part in ("sensor", "radio"):
                own = getattr(entry, part)
                written[part] = own and own.model_dump(mode="json", exclude_unset=True)
    return yaml.dump(
        data, Dumper=Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110
    )


def _given(section: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in section.items() if value is not None}
