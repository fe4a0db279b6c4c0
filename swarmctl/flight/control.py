"""Orders to a flight under way: a Unix socket in the run's folder, one line of words, one line of answer."""

import asyncio
import contextlib
import os
import socket
import tempfile
from collections.abc import Callable
from pathlib import Path

NAME = "control"
ANSWER_S = 10.0
Obey = Callable[[list[str]], str]


class ControlError(Exception):
    """An order that cannot be given or was refused; the message says why."""


class ControlServer:
    """Listens while a flight is under way; ``obey`` carries out an order and answers, or raises ControlError.

    The socket lies in a folder of its own, since a path of over a hundred characters cannot be bound; the run's
    folder holds a file that says where.
    """

    def __init__(self, run: Path, obey: Obey) -> None:
        self._note = run / NAME
        self._obey = obey
        self._folder = tempfile.TemporaryDirectory(prefix="swarmctl-")
        self._server: asyncio.Server | None = None

    async def start(self) -> None:
        """Open the socket."""
        path = os.path.join(self._folder.name, NAME)
        self._server = await asyncio.start_unix_server(self._serve, path)
        self._note.write_text(path + "\n")

    def close(self) -> None:
        """Close the socket and remove what it left."""
        if self._server is not None:
            self._server.close()
        with contextlib.suppress(OSError):
            self._note.unlink()
        self._folder.cleanup()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        words = (await reader.readline()).decode(errors="replace").split()
        try:
            answer = "done: " + self._obey(words)
        except ControlError as error:
            answer = f"refused: {error}"
        writer.write(answer.encode() + b"\n")
        with contextlib.suppress(ConnectionError):
            await writer.drain()
        writer.close()


def is_under_way(run: Path) -> bool:
    """Whether a flight that records into ``run`` listens; one that was killed leaves its note behind."""
    try:
        path = (run / NAME).read_text().strip()
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(ANSWER_S)
            connection.connect(path)
    except OSError:
        return False
    return True


def send(run: Path, words: list[str]) -> str:
    """Give an order to the flight that records into ``run``.  Raises ControlError."""
    note = run / NAME
    try:
        path = note.read_text().strip()
    except OSError:
        raise ControlError(f"{run}: no flight is under way there") from None
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(ANSWER_S)
        try:
            connection.connect(path)
            connection.sendall(" ".join(words).encode() + b"\n")
            answer = connection.makefile().readline().strip()
        except OSError as error:
            raise ControlError(f"{run}: the flight does not answer: {error}") from None
    if not answer.startswith("done: "):
        raise ControlError(answer.removeprefix("refused: ") or "the flight ended before it answered")
    return answer.removeprefix("done: ")
