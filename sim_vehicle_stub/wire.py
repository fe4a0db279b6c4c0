"""What GLOBAL_POSITION_INT tells of a place, as the fleet hands it to every vehicle at every tick."""

Wire = tuple[int, int, int, int, int, int, int]
"""From `lat` to `vz`: 1e-7 degrees, mm above sea level and above home, cm/s north, east, down."""
