"""What a vehicle-tick of the stub costs: move, send GLOBAL_POSITION_INT, take a setpoint.

``python benchmarks/stub_tick.py``
"""

from time import perf_counter

from sim_vehicle_stub.fleet import StubFleet
from sim_vehicle_stub.personalities import px4_defaults
from sim_vehicle_stub.pilot import Limits
from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.dialect import mav

VEHICLES, TICKS = 6, 16_000
HEARTBEAT = 0
ORIGIN = (47.3977, 8.5456, 488.0)
MASK = 1 | 2 | 32 | 64 | 128 | 256 | 2048


def commands_of(encoder: Encoder, system: int) -> list[bytes]:
    """Turn everything down but position at 10 Hz, switch to OFFBOARD and arm."""
    quiet = [(message, -1) for message in px4_defaults.INTERVALS_US if message != HEARTBEAT]
    orders = [(511, message, interval) for message, interval in [*quiet, (33, 100_000)]]
    orders += [(176, 1, 6), (400, 1, 0)]
    return [
        encoder.encode(mav.MAVLink_command_long_message(system, 1, number, 0, a, b, 0, 0, 0, 0, 0))
        for number, a, b in orders
    ]


def main() -> None:
    """Print microseconds a vehicle-tick."""
    limits = Limits(speed_mps=25.0, acceleration_mps2=4.0)
    pads = [(20.0 * index, 0.0) for index in range(VEHICLES)]
    fleet = StubFleet(VEHICLES, origin=ORIGIN, pads_m=pads, limits=limits)
    encoders = [Encoder(255, 190) for _ in fleet.vehicles]
    sent = 0
    started = 0.0
    for tick in range(TICKS + 100):
        now = tick / 10
        if tick == 60:
            for vehicle, encoder in zip(fleet.vehicles, encoders, strict=True):
                for order in commands_of(encoder, vehicle.system):
                    vehicle.receive(order, now - 0.1)
        setpoints = [
            encoder.set_position_target_local_ned(
                0, index + 1, 1, 1, MASK, 0.0, 0.0, -100.0, 10.0, 5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            )
            for index, encoder in enumerate(encoders)
        ]
        start = perf_counter()
        fleet.advance(now)
        for vehicle, setpoint in zip(fleet.vehicles, setpoints, strict=True):
            sent += len(vehicle.outgoing())
            vehicle.receive(setpoint, now)
        if tick >= 100:
            started += perf_counter() - start
    if not all(row["up"] > 99.0 for row in fleet.truth):
        raise SystemExit("the vehicles do not fly: nothing was measured")
    print(f"{started / TICKS / VEHICLES * 1e6:.2f} µs a vehicle-tick, {sent} frames")


if __name__ == "__main__":
    main()
