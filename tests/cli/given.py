"""What the command line's tests share: a mission so small that a whole flight takes a second, and a type."""

from collections.abc import Callable

from click.testing import Result

Swarmctl = Callable[..., Result]
"""Runs a command in this process."""

SMALL = """
name: small
area: {size_m: [700, 600]}
keep_out:
  - {box_m: [300, 380, 300, 380]}
vehicles: {count: 3, speed_mps: 18, altitude_m: 8}
sensor: {range_m: 120}
targets: {clusters: 5, count: 50, radius_m: 40}
duration_s: 30
"""
