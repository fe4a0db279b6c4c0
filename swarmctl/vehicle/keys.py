"""The signing key's file, and the newest time signed with it, kept over restarts.

Times in signatures must never go back, or vehicles would take every frame for a replay.  The clock sees to it as
long as it is right; one that was set back, or forgets the date when the power goes, is made up for by a small
file in the state folder ($XDG_STATE_HOME/swarmctl, usually ~/.local/state/swarmctl), one for each key.
"""

import contextlib
import os
import stat
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

from swarmctl.mavlink.signing import KEEP_EVERY, KEY_BYTES, Signing, parse_key, units

MOST_BYTES = 4 * KEY_BYTES


class SigningKeyError(Exception):
    """A key file that cannot be used; the message names it and says what to do."""


def read_key(path: Path) -> bytes:
    """The key in ``path``.  Raises SigningKeyError."""
    try:
        with path.open("rb") as file:
            return parse_key(file.read(MOST_BYTES + 1))
    except OSError as error:
        raise SigningKeyError(f"{path}: cannot read the signing key: {error.strerror}") from None
    except ValueError as error:
        how = "make one with: openssl rand -hex 32"
        raise SigningKeyError(f"{path}: not a signing key: {error} ({how})") from None


def exposure(path: Path) -> str | None:
    """What is wrong with the file's permissions, if anything."""
    if path.stat().st_mode & stat.S_IROTH:
        return f"{path}: everybody on this machine can read this signing key (chmod 600 {path})"
    return None


def signing_with(key: bytes, utc_s: Callable[[], float]) -> Signing:
    """Signing with ``key`` by a clock of seconds since 1970, going on where the last program left off."""
    kept = _kept_file(key)
    newest = 0
    with contextlib.suppress(OSError, ValueError):
        newest = int(kept.read_text())
    if units(utc_s()) < newest:  # the clock was set back, and frames were signed after the last that was kept
        newest += KEEP_EVERY

    def keep(time: int) -> None:
        with contextlib.suppress(
            OSError
        ):  # a full disk is no reason not to fly; the clock is right, as a rule
            kept.parent.mkdir(parents=True, exist_ok=True)
            part = kept.with_suffix(f".{os.getpid()}")
            part.write_text(f"{time}\n")
            part.replace(kept)

    return Signing(key, lambda: units(utc_s()), newest, keep)


def _kept_file(key: bytes) -> Path:
    """Where the newest time is kept, under a name that does not tell the key."""
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "swarmctl" / f"signed-{sha256(b'swarmctl' + key).hexdigest()[:16]}"
