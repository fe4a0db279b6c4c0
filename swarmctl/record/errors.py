"""What can go wrong with the files of a run, said in one line to the person at the terminal."""

from pathlib import Path
from typing import Self


class RecordError(Exception):
    """A file of a run cannot be written or read; the message names the file and what to do."""


class RunFolderError(RecordError):
    """A run folder cannot be made, opened or written to."""

    @classmethod
    def writing(cls, path: Path, reason: OSError) -> Self:
        """The error of a write to ``path`` that the system refused for ``reason``."""
        said = reason.strerror or str(reason)
        return cls(f"{path}: cannot write: {said} (make room or rights there, or choose another --out)")


class LogError(RecordError):
    """A log is not there, or is not a log of ours."""
