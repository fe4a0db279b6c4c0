"""What to fly: the mission file's keys, their types, ranges and defaults, and nothing that needs two keys.

The models mirror the file key by key, so that a mission can be written down again as it was read.  They are
strict (no "25" for 25), closed (no unknown keys), frozen, and take no NaN or infinity.  Metres are [east,
north] from the origin, in keys that end in ``_m``; ``polygon`` is [latitude, longitude] in degrees.
What two keys together can get wrong is in checks.py.
"""

from functools import cached_property
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, field_validator, model_validator

P = TypeVar("P", bound="Part")

FARTHEST_M = 100_000.0
WIDEST_M = 250_000.0
"""A side of a rectangle: 10,000 vehicles at the reference scenario's density want 204 km."""
FASTEST_MPS = 30.0
"""The stub's limit; no faster multicopter is known to this program."""
MOST_VEHICLES = 10_000

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Probability = Annotated[float, Field(ge=0, le=1)]
Metres = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
Length = Annotated[float, Field(gt=0, le=FARTHEST_M)]
Side = Annotated[float, Field(gt=0, le=WIDEST_M)]
Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]
# Not strict: YAML has lists where these want tuples.  Their items stay strict.
PointM = Annotated[tuple[Metres, Metres], Field(strict=False)]
PointDegrees = Annotated[tuple[Latitude, Longitude], Field(strict=False)]
PolygonM = Annotated[tuple[PointM, ...], Field(strict=False, min_length=3)]
PolygonDegrees = Annotated[tuple[PointDegrees, ...], Field(strict=False, min_length=3)]
PointsM = Annotated[tuple[PointM, ...], Field(strict=False)]
Standing = Literal["corner", "spread", "as_found"]
Autopilot = Literal["auto", "px4", "ardupilot"]


class Part(BaseModel):
    """What all parts of a mission have in common."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)

    def only_one_of(self, *keys: str, required: bool) -> None:
        """Raise ValueError unless just one of ``keys`` is given (or, if not ``required``, at most one)."""
        given = [key for key in keys if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"give only one of {' and '.join(given)}")
        if required and not given:
            raise ValueError(f"give one of {', '.join(keys)}")


class Origin(Part):
    """The geodetic origin of the local frame; ``alt_m`` is its ellipsoidal altitude."""

    lat: Annotated[float, Field(ge=-85, le=85)] = 47.3977
    lon: Longitude = 8.5456
    alt_m: Annotated[float, Field(ge=-500, le=9000)] = 488.0


class Area(Part):
    """The keep-in: a rectangle with its south-west corner in the origin, a polygon, or a file with one."""

    size_m: Annotated[tuple[Side, Side], Field(strict=False)] | None = None
    polygon: PolygonDegrees | None = None
    polygon_m: PolygonM | None = None
    file: str | None = None

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        self.only_one_of("size_m", "polygon", "polygon_m", "file", required=True)
        return self


class Circle(Part):
    """A circle in local metres."""

    center_m: PointM
    radius_m: Length


class KeepOut(Part):
    """One place that nobody may enter; ``box_m`` is east_min, east_max, north_min, north_max."""

    box_m: Annotated[tuple[Metres, Metres, Metres, Metres], Field(strict=False)] | None = None
    circle_m: Circle | None = None
    polygon: PolygonDegrees | None = None
    polygon_m: PolygonM | None = None

    @field_validator("box_m")
    @classmethod
    def _box_in_order(cls, box: tuple[float, ...] | None) -> tuple[float, ...] | None:
        if box and not (box[0] < box[1] and box[2] < box[3]):
            raise ValueError(
                "the order is east_min, east_max, north_min, north_max, each minimum the smaller"
            )
        return box

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        self.only_one_of("box_m", "circle_m", "polygon", "polygon_m", required=True)
        return self


class Sensor(Part):
    """What a vehicle sees: the radius, and how well."""

    range_m: Length = 200.0
    detection_probability: Probability = 1.0
    false_alarms_per_hour: Annotated[float, Field(ge=0, le=3600)] = 0.0
    position_noise_m: NotNegative = 0.0


class Radio(Part):
    """Whom a vehicle can tell: range 0 is silence; ``bandwidth_bps`` None is without limit."""

    range_m: Annotated[float, Field(ge=0)] = 600.0
    loss: Probability = 0.0
    delay_s: Annotated[float, Field(ge=0, le=600)] = 0.0
    bandwidth_bps: Annotated[float, Field(gt=0, le=1e12)] | None = None


def _kind(value: Any) -> str | None:
    """Which member of a union of a word, a list and a mapping ``value`` is meant for."""
    if isinstance(value, str):
        return "<word>"
    if isinstance(value, (list, tuple)):
        return "<list>"
    return "<mapping>" if isinstance(value, (dict, Part)) else None


def _either(message: str) -> Discriminator:
    return Discriminator(_kind, custom_error_type="either", custom_error_message=message)


Launch = Annotated[
    Annotated[Standing, Tag("<word>")] | Annotated[PointsM, Tag("<list>")],
    _either("must be corner, spread, as_found, or a list of [east, north]"),
]
OneLaunch = Annotated[
    Annotated[Standing, Tag("<word>")] | Annotated[PointM, Tag("<list>")],
    _either("must be corner, spread, as_found, or [east, north]"),
]
Speed = Annotated[float, Field(gt=0, le=FASTEST_MPS)]
Altitude = Annotated[float, Field(gt=0, le=10_000)]
Connect = Annotated[
    str, Field(pattern=r"^((udp|udpin|udpout|tcp)://[^:/\s]*:\d{1,5}(-\d{1,5})?|serial:///[^:\s]+:\d+)$")
]


class VehicleGroup(Part):
    """Vehicles that are all alike; vehicle i flies ``layer_m`` times i above ``altitude_m``."""

    count: Annotated[int, Field(ge=1, le=MOST_VEHICLES)] = 6
    speed_mps: Speed = 25.0
    altitude_m: Altitude = 100.0
    launch: Launch = "corner"
    spacing_m: Length = 20.0
    layer_m: NotNegative = 0.0
    autopilot: Autopilot = "auto"
    endurance_s: Positive | None = None


class VehicleEntry(Part):
    """One vehicle of a mixed fleet; its sensor and radio replace the mission's, key by key."""

    speed_mps: Speed = 25.0
    altitude_m: Altitude = 100.0
    sensor: Sensor | None = None
    radio: Radio | None = None
    autopilot: Autopilot = "auto"
    connect: Connect | None = None
    launch: OneLaunch = "corner"
    endurance_s: Positive | None = None


Vehicles = Annotated[
    Annotated[VehicleGroup, Tag("<mapping>")]
    | Annotated[
        tuple[VehicleEntry, ...], Field(strict=False, min_length=1, max_length=MOST_VEHICLES), Tag("<list>")
    ],
    _either("must be a mapping (count: ...) or a list, one entry a vehicle"),
]


class Targets(Part):
    """What is searched for: drawn in clusters, or placed (``file``: GeoJSON points; ``positions_m``), which
    counts as one cluster.  The speeds are the greatest of a wandering target and that of a drifting cluster."""

    clusters: Annotated[int, Field(ge=1, le=20_000)] = 6
    count: Annotated[int, Field(ge=0, le=1_500_000)] = 450
    radius_m: Length = 300.0
    hot_spot_share: Probability = 0.4
    motion: Literal["static", "wander"] = "static"
    wander_mps: Speed = 1.0
    cluster_motion: Literal["static", "drift"] = "static"
    cluster_mps: Speed = 1.5
    file: str | None = None
    positions_m: PointsM | None = None

    @property
    def move(self) -> bool:
        """Whether they are anywhere else later than where they were laid out."""
        return self.motion != "static" or self.cluster_motion != "static"

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        self.only_one_of("file", "positions_m", required=False)
        return self


class Planner(Part):
    """Which algorithm, how often, and what differs from its own parameters."""

    algorithm: str = "fco"
    period_s: Annotated[float, Field(gt=0, le=60)] = 1.0
    terms: Literal["unit", "metric"] = "unit"
    parameters: dict[str, dict[str, float | str]] = {}


class Safety(Part):
    """Limits that the guard keeps, and what ends a flight."""

    separation_m: Length = 15.0
    fence_margin_m: Annotated[float, Field(ge=0, le=FARTHEST_M)] = 20.0
    max_acceleration_mps2: Annotated[float, Field(gt=0, le=50)] = 4.0
    link_loss_s: Annotated[float, Field(ge=1.5, le=3600)] = 3.0
    battery_return_percent: Annotated[float, Field(ge=0, le=100)] = 25.0
    if_one_fails: Literal["abort", "continue"] = "abort"
    minimum_vehicles: Annotated[int, Field(ge=1, le=MOST_VEHICLES)] = 1


class Stub(Part):
    """The stub vehicles' firmware, and the wind (east, north) they fly in."""

    autopilot: Literal["px4", "ardupilot"] = "px4"
    wind_mps: Annotated[tuple[float, float], Field(strict=False)] = (0.0, 0.0)


class Setpoints(Part):
    """How often each vehicle is told what to do; below 2 Hz autopilots take the link for lost."""

    rate_hz: Annotated[float, Field(ge=2, le=100)] = 10.0


class Vehicle(Part):
    """One vehicle of the fleet, everything resolved; ``launch`` is its pad if the mission names one."""

    speed_mps: float
    altitude_m: float
    sensor: Sensor
    radio: Radio
    autopilot: Autopilot = "auto"
    connect: str | None = None
    launch: tuple[float, float] | None = None
    endurance_s: float | None = None


class Mission(Part):
    """A whole mission.  ``load.load`` makes one that is checked; the constructor alone checks single keys."""

    name: Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f]*$")] = "mission"
    origin: Origin = Origin()
    area: Area = Area(size_m=(5000.0, 5000.0))
    keep_out: Annotated[tuple[KeepOut, ...], Field(strict=False, max_length=1000)] = ()
    vehicles: Vehicles = VehicleGroup()
    sensor: Sensor = Sensor()
    radio: Radio = Radio()
    targets: Targets = Targets()
    planner: Planner = Planner()
    safety: Safety = Safety()
    stub: Stub = Stub()
    setpoints: Setpoints = Setpoints()
    dynamics: Literal["ideal", "multicopter"] | None = None
    observations: Literal["exact", "wire"] = "exact"
    duration_s: Annotated[float, Field(gt=0, le=86_400)] = 1600.0

    @cached_property
    def fleet(self) -> tuple[Vehicle, ...]:
        """One entry a vehicle, in order; vehicle i has system id i + 1."""
        if isinstance(self.vehicles, VehicleGroup):
            group = self.vehicles
            return tuple(self._of_group(group, k) for k in range(group.count))
        return tuple(self._of_entry(entry) for entry in self.vehicles)

    @property
    def launch(self) -> Standing | tuple[tuple[float, float], ...]:
        """``corner``, ``spread``, ``as_found``, or the pads, [east, north] each, one a vehicle."""
        if isinstance(self.vehicles, VehicleGroup):
            return self.vehicles.launch
        first = self.vehicles[0].launch
        if isinstance(first, str):
            return first
        return tuple(entry.launch for entry in self.vehicles if not isinstance(entry.launch, str))

    @property
    def spacing_m(self) -> float:
        """Metres between the pads of a corner launch."""
        return (self.vehicles if isinstance(self.vehicles, VehicleGroup) else VehicleGroup()).spacing_m

    def _of_group(self, group: VehicleGroup, index: int) -> Vehicle:
        pads = group.launch
        return Vehicle(
            speed_mps=group.speed_mps,
            altitude_m=group.altitude_m + index * group.layer_m,
            sensor=self.sensor,
            radio=self.radio,
            autopilot=group.autopilot,
            launch=None if isinstance(pads, str) or index >= len(pads) else pads[index],
            endurance_s=group.endurance_s,
        )

    def _of_entry(self, entry: VehicleEntry) -> Vehicle:
        return Vehicle(
            speed_mps=entry.speed_mps,
            altitude_m=entry.altitude_m,
            sensor=_over(self.sensor, entry.sensor),
            radio=_over(self.radio, entry.radio),
            autopilot=entry.autopilot,
            connect=entry.connect,
            launch=None if isinstance(entry.launch, str) else entry.launch,
            endurance_s=entry.endurance_s,
        )


def _over(wide: P, own: P | None) -> P:
    """``wide`` with the keys that ``own`` was given."""
    if own is None:
        return wide
    return wide.model_copy(update={key: getattr(own, key) for key in own.model_fields_set})
