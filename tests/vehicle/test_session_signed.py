"""Sessions and vehicles that sign: both ways nothing else gets through, and what is dropped is counted and told."""

import pytest

from swarmctl.mavlink.codec import Encoder
from swarmctl.mavlink.signing import Verdict, units
from swarmctl.vehicle.events import EventKind
from swarmctl.vehicle.phases import Phase
from swarmctl.vehicle.session import Session
from swarmctl.vehicle.settings import SessionSettings

from .signed import DATE_S, KEY, OTHER_KEY, set_up, signed_flight, ticking
from .stub_flight import BOTH, StubFlight

RTL = {"px4": 0x05040000, "ardupilot": 6}


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_whole_flight_is_signed_both_ways(autopilot: str) -> None:
    rig = signed_flight(autopilot)
    rig.command(5.0, 0.0)
    rig.engage()
    rig.run(10.0)
    assert rig.body["east"] > 30.0
    rig.land()
    assert len(rig.crossed) > 500
    assert all(frame.raw[2] == 1 for _, frame in rig.crossed)
    figures = rig.session.statistics()
    assert (figures.messages_lost, figures.messages_unsigned, figures.messages_replayed) == (0, 0, 0)
    assert not any(rig.vehicle.keyring.refused.values())


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_pilot_without_the_key_is_not_obeyed(autopilot: str) -> None:
    rig = signed_flight(autopilot)
    rig.command(0.0, 0.0)
    rig.engage()
    mode = rig.mode
    rig.pilot_sets_mode(RTL[autopilot])
    rig.run(3.0)
    assert (rig.mode, rig.session.phase) == (mode, Phase.ENGAGED)
    assert rig.vehicle.keyring.refused[Verdict.UNSIGNED] == 1


def test_what_a_stranger_says_in_the_vehicles_name_is_dropped_counted_and_told() -> None:
    rig = signed_flight()
    rig.command(0.0, 0.0)
    rig.engage()
    stranger, forger = Encoder(1, 1), ticking(key=OTHER_KEY)
    taken_over = stranger.heartbeat(2, 12, 0x80, RTL["px4"], 4)
    recorded = next(f.raw for _, f in rig.crossed if f.system == 1 and f.message_id == 0)
    for frame in (taken_over, forger.sign(taken_over, 0), recorded):
        rig.session.receive(frame, rig.now)
    rig.run(3.0)
    assert rig.session.phase is Phase.ENGAGED
    figures = rig.session.statistics()
    counts = (figures.messages_unsigned, figures.messages_wrongly_signed, figures.messages_replayed)
    assert counts == (1, 1, 1)
    told = rig.texts(EventKind.WARNING)
    assert told == [
        f"vehicle 1: frames in its name are dropped: {what}"
        for what in ("unsigned", "wrongly signed", "replayed")
    ]


@pytest.mark.parametrize("vehicle_key", [None, OTHER_KEY], ids=["none", "another"])
def test_a_vehicle_without_our_key_is_never_taken_up(vehicle_key: bytes | None) -> None:
    rig = signed_flight(vehicle_key=vehicle_key)
    rig.run(20.0)
    assert rig.session.phase is Phase.CONNECTING
    dropped = rig.session.statistics()
    assert max(dropped.messages_unsigned, dropped.messages_wrongly_signed) > 100
    theirs = rig.vehicle.keyring.refused
    assert theirs[Verdict.WRONG] == (0 if vehicle_key is None else 20)


def test_a_vehicle_that_thinks_it_is_2015_is_taken_up_once_it_has_heard_us() -> None:
    rig = signed_flight(date_s=1.5e9)
    rig.until_phase(Phase.READY)
    assert rig.session.statistics().messages_replayed > 0


def test_a_vehicle_whose_clock_is_ahead_hears_a_session_that_begins() -> None:
    rig = signed_flight(date_s=DATE_S + 86400.0)
    rig.until_phase(Phase.READY)


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_controller_that_was_killed_and_starts_again_is_believed(autopilot: str) -> None:
    rig = signed_flight(autopilot)
    rig.until_phase(Phase.READY)
    rig.session = Session(1, settings=SessionSettings(), now=rig.now, signing=ticking(lambda: rig.now))
    rig.until_phase(Phase.READY)
    assert rig.vehicle.keyring.refused[Verdict.REPLAYED] == 0


def test_ardupilot_takes_a_key_over_the_link_and_gives_it_up_again() -> None:
    rig = signed_flight("ardupilot", vehicle_key=None)
    rig.run(2.0)
    rig.pilot_sends(set_up(KEY, units(DATE_S)))
    rig.until_phase(Phase.READY)
    assert rig.session.statistics().messages_unsigned > 0, "before it had the key"
    rig.vehicle.receive(
        ticking(lambda: rig.now + 90.0).sign(Encoder(254, 190).encode(set_up(bytes(32), 0)), 9), rig.now
    )
    before = rig.session.statistics().messages_unsigned
    rig.run(2.0)
    assert rig.session.statistics().messages_unsigned > before + 10


def test_ardupilot_takes_no_key_while_armed_nor_from_a_stranger() -> None:
    rig = StubFlight("ardupilot")
    rig.hold_at()
    rig.pilot_sends(set_up(KEY, units(DATE_S)))
    rig.run(1.0)
    assert rig.session.phase is Phase.HOLDING
    assert rig.texts(EventKind.TEXT)[-1] == "ERROR: Won't setup signing when armed"
    signed = signed_flight("ardupilot")
    signed.until_phase(Phase.READY)
    signed.pilot_sends(set_up(OTHER_KEY, units(DATE_S)))
    signed.run(5.0)
    assert signed.session.phase is Phase.READY


def test_px4_knows_no_such_message() -> None:
    rig = StubFlight("px4")
    rig.until_phase(Phase.READY)
    rig.pilot_sends(set_up(KEY, units(DATE_S)))
    rig.run(5.0)
    assert rig.session.phase is Phase.READY


@pytest.mark.parametrize("autopilot", BOTH)
def test_a_vehicle_that_reboots_is_set_up_again(autopilot: str) -> None:
    rig = signed_flight(autopilot)
    rig.until_phase(Phase.READY)
    rig.vehicle.reboot()
    rig.run(10.0)
    rig.until_phase(Phase.READY)
