"""Key files, and times that go on over restarts."""

import os
from pathlib import Path

import pytest

from swarmctl.mavlink.signing import STALE, units
from swarmctl.vehicle import keys

from .signed import DATE_S, KEY, OTHER_KEY, beat

FRAME = beat(1)


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The state folder of this test alone."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state"


def time_of(signed: bytes) -> int:
    return int.from_bytes(signed[-12:-6], "little")


def test_a_key_is_read_and_who_else_may_read_it_is_told(tmp_path: Path) -> None:
    path = tmp_path / "key"
    path.write_text(KEY.hex() + "\n")
    path.chmod(0o600)
    assert (keys.read_key(path), keys.exposure(path)) == (KEY, None)
    path.chmod(0o644)
    assert (
        keys.exposure(path)
        == f"{path}: everybody on this machine can read this signing key (chmod 600 {path})"
    )


def test_what_is_wrong_with_a_key_file_is_said(tmp_path: Path) -> None:
    (tmp_path / "key").write_text("secret")
    with pytest.raises(
        keys.SigningKeyError, match=r"key: not a signing key: it must hold 64 hex digits.*openssl rand"
    ):
        keys.read_key(tmp_path / "key")
    with pytest.raises(keys.SigningKeyError, match="none: cannot read the signing key: No such file"):
        keys.read_key(tmp_path / "none")


def test_times_follow_the_clock_while_it_is_right() -> None:
    now = [DATE_S]
    for later in (0.0, 1.0, 3600.0):
        now[0] = DATE_S + later
        signed = keys.signing_with(KEY, lambda: now[0]).sign(FRAME, 1)
        assert 0 <= time_of(signed) - units(now[0]) <= 1


def test_times_never_go_back_though_the_clock_does() -> None:
    first = keys.signing_with(KEY, lambda: DATE_S)
    last = [first.sign(FRAME, 1) for _ in range(100)][-1]
    for set_back_to in (DATE_S - 3600.0, 0.0):
        signed = keys.signing_with(KEY, lambda at=set_back_to: at).sign(FRAME, 1)  # type: ignore[misc]
        assert time_of(signed) > time_of(last)
        last = signed


def test_a_hundred_restarts_in_a_second_do_not_run_ahead_of_what_vehicles_take() -> None:
    for k in range(100):
        now_s = DATE_S + 0.01 * k
        signed = keys.signing_with(KEY, lambda at=now_s: at).sign(FRAME, 1)  # type: ignore[misc]
    assert time_of(signed) - units(now_s) < STALE


def test_each_key_has_times_of_its_own() -> None:
    keys.signing_with(KEY, lambda: DATE_S).sign(FRAME, 1)
    assert time_of(keys.signing_with(OTHER_KEY, lambda: DATE_S - 3600.0).sign(FRAME, 1)) == units(
        DATE_S - 3600.0
    )


def test_what_is_kept_does_not_tell_the_key(state: Path) -> None:
    keys.signing_with(KEY, lambda: DATE_S).sign(FRAME, 1)
    (kept,) = (state / "swarmctl").iterdir()
    assert KEY.hex()[:8] not in kept.name + kept.read_text()


def test_a_state_folder_that_cannot_be_written_or_holds_nonsense_stops_nobody(state: Path) -> None:
    keys.signing_with(KEY, lambda: DATE_S).sign(FRAME, 1)
    (kept,) = (state / "swarmctl").iterdir()
    kept.write_text("nonsense")
    assert time_of(keys.signing_with(KEY, lambda: DATE_S).sign(FRAME, 1)) == units(DATE_S)
    os.remove(kept)
    (state / "swarmctl").rmdir()
    (state / "swarmctl").touch()
    assert time_of(keys.signing_with(KEY, lambda: DATE_S).sign(FRAME, 1)) == units(DATE_S)
