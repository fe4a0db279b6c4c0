"""What a study sees and obeys that sees what messages carry."""

import numpy as np
import pytest

from swarmctl.core import stages, state
from swarmctl.core.world import World
from swarmctl.mavlink.codec import Decoder, Encoder
from swarmctl.mission.load import load
from swarmctl.mission.scenario import Scenario
from swarmctl.vehicle.autopilots.px4 import Px4
from swarmctl.vehicle.telemetry import GeoPoint, Telemetry


def studied(observations: str, **keys: object) -> World:
    """A short mission's world."""
    given = {"duration_s": 30.0, "vehicles.altitude_m": 12.3, "observations": observations, **keys}
    return Scenario(load(None, given), ideal=False).world(1, "bounce")


def test_what_is_seen_lies_on_the_messages_grid_and_the_truth_does_not() -> None:
    world = studied("wire")
    world.run_multicopter()
    apart = [world.poses[name] - world.truth[name] for name in state.POSE.names or ()]
    assert 0.001 < np.hypot(*apart[:2]).max() < 0.01  # half of 1e-7 degrees is 5.6 mm of latitude
    world.prepare()
    world.errands["stage"] = stages.SEARCH
    world.truth["up"], world.truth["v_east"] = 12.34567, 3.14159
    world.search(0, 0, 1, np.array([np.inf, 0.0, 0.0, 0.0]))
    assert (world.poses["up"] * 1000.0 == np.round(world.poses["up"] * 1000.0)).all()
    assert (np.abs(world.poses["v_east"] * 100.0 - np.round(world.poses["v_east"] * 100.0)) < 1e-9).all()
    assert (world.truth["up"] * 1000.0 != np.round(world.truth["up"] * 1000.0)).all()


def test_where_all_is_seen_exactly_there_is_one_array() -> None:
    world = studied("exact")
    assert world.truth is world.poses


@pytest.mark.parametrize("up", [12.3, 100.0, 7.77])
@pytest.mark.parametrize("altitude", [488.0, 12.345, 0.0])
def test_a_setpoint_is_rounded_as_the_message_does_it(up: float, altitude: float) -> None:
    world = studied("wire", **{"origin.alt_m": altitude})
    world.prepare()
    world.errands["stage"] = stages.SEARCH
    world.fleet["altitude"] = up
    world.truth["up"] = world.poses["up"] = up
    here = GeoPoint(47.0, 8.0, altitude)
    frame = Px4().setpoint(Encoder(255, 190), 1, Telemetry(home=here, origin=here), (1.1, 2.2), up)
    (told,) = Decoder().feed(frame)
    rounded = altitude - told.fields.z - altitude
    assert (rounded != up) == (up != 100.0)
    world.wishes["v_east"], world.wishes["v_north"] = 0.3, -0.2  # reached at once: told is flown
    world.in_range = world.in_range[:0]  # no period is planned: the wishes stand
    world.rules["interval"] = 1.0
    world.search(-1, 0, 1, np.array([np.inf, 0.0, 0.0, 0.0]))
    assert set(world.truth["v_east"]) == {float(np.float32(0.3))}
    assert set(world.truth["v_north"]) == {float(np.float32(-0.2))}
    assert set(np.sign(world.truth["up"] - up)) == {np.sign(rounded - up)}
