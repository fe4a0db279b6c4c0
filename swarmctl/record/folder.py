"""A run is a folder: this makes it, opens it, and knows what lies in it.

Small files are written whole or not at all: into a temporary file beside them, then renamed.  Every refusal
of the system becomes a :class:`RunFolderError`, and a folder that could not be made leaves nothing behind.
"""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from itertools import chain, count
from pathlib import Path
from typing import Self

from .errors import RunFolderError

DEFAULT_PARENT = Path("runs")
PROBE_BYTES = 64 * 1024


@dataclass(frozen=True, slots=True)
class RunFolder:
    """One run's folder; the properties are the paths of its files, whether they exist yet or not."""

    path: Path

    @property
    def mission(self) -> Path:
        """The mission as resolved."""
        return self.path / "mission.yaml"

    @property
    def mcap(self) -> Path:
        """What was seen, known, decided and told, tick by tick."""
        return self.path / "flight.mcap"

    @property
    def tlog(self) -> Path:
        """Every MAVLink frame."""
        return self.path / "flight.tlog"

    @property
    def summary(self) -> Path:
        """The figures of the run."""
        return self.path / "summary.json"

    @property
    def tracks(self) -> Path:
        """The picture of the run."""
        return self.path / "tracks.png"

    @property
    def report(self) -> Path:
        """The page about the run."""
        return self.path / "report.html"

    @classmethod
    def create(cls, out: Path | None, *, algorithm: str, now: datetime) -> Self:
        """A new, empty folder: ``out``, or runs/YYYYmmdd-HHMMSS-ALGORITHM with -2, -3 ... if that is taken.

        Parents are made.  Raises :class:`RunFolderError` if ``out`` is a file or not empty, or if the folder
        cannot be made or has no room for a first file; what was made of it is then removed again.
        """
        if out is not None:
            _refuse_used(out)
            if not _make(out, exist_ok=True):
                raise RunFolderError(f"{out}: exists and is not a folder (choose another --out)")
            return cls(out)
        name = f"{now:%Y%m%d-%H%M%S}-{algorithm}"
        names = chain([name], (f"{name}-{number}" for number in count(2)))
        return cls(next(path for path in map(DEFAULT_PARENT.joinpath, names) if _make(path, exist_ok=False)))

    @classmethod
    def open(cls, path: Path) -> Self:
        """The folder of a run that was recorded.  Raises :class:`RunFolderError` if it is none."""
        folder = cls(path)
        if not os.path.exists(path):
            raise RunFolderError(
                f"{path}: no such run (runs are kept in {DEFAULT_PARENT}/ unless --out was given)"
            )
        if not os.path.isdir(path):
            raise RunFolderError(f"{path}: not a folder (name the run's folder, not a file in it)")
        missing = [file.name for file in (folder.mission, folder.mcap) if not os.path.isfile(file)]
        if missing:
            raise RunFolderError(f"{path}: not a run folder: it has no {' and no '.join(missing)}")
        return folder

    def remove_if_empty(self) -> None:
        """Remove the folder if nothing was written into it."""
        with suppress(OSError):
            self.path.rmdir()

    def write_text(self, path: Path, text: str) -> None:
        """Write ``path`` (a file of this folder) whole, or leave what was there and raise RunFolderError."""
        write_whole(path, text.encode())

    def write_json(self, path: Path, content: Mapping[str, object]) -> None:
        """Write ``path`` as indented JSON.  Raises ValueError for NaN and infinity, which JSON lacks."""
        self.write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def write_whole(path: Path, data: bytes) -> None:
    """Write a small file whole, or leave what was there and raise :class:`RunFolderError`."""
    temporary = path.with_name(f".{path.name}.part")
    try:
        with temporary.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        with suppress(OSError):
            temporary.unlink()
        raise RunFolderError.writing(path, error) from None


def _refuse_used(out: Path) -> None:
    """A folder that holds something is never written into."""
    try:
        used = out.is_dir() and any(out.iterdir())
    except OSError as error:
        raise RunFolderError.writing(out, error) from None
    if used:
        raise RunFolderError(f"{out}: not empty (choose another --out, or remove what is in it)")


def _make(path: Path, *, exist_ok: bool) -> bool:
    """Make a folder with its parents and try whether it takes a file; False if its name is taken."""
    with _or_nothing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            path.mkdir(exist_ok=exist_ok)
        except FileExistsError:
            return False
        _try_room(path / ".room")
    return True


@contextmanager
def _or_nothing(path: Path) -> Iterator[None]:
    """If what happens here fails, remove those of the path's folders that were not there before."""
    absent = [folder for folder in (path, *path.parents) if not os.path.lexists(folder)]
    try:
        yield
    except OSError as error:
        for folder in absent:
            with suppress(OSError):
                folder.rmdir()
        raise RunFolderError.writing(path, error) from None


def _try_room(probe: Path) -> None:
    """Write a file and remove it: a full disk often still takes a folder."""
    try:
        with probe.open("wb") as file:
            file.write(bytes(PROBE_BYTES))
            file.flush()
            os.fsync(file.fileno())
    finally:
        probe.unlink(missing_ok=True)
