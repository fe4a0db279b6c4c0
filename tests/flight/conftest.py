"""Processes that tests of live flights start, and that end with them."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from .processes import HOME, SPEED, Start, read_until


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts `python -m MODULE WORDS`; whatever still runs at the end is killed."""
    running: list[subprocess.Popen[str]] = []

    def run(module: str, *words: Any) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", module, *map(str, words)]
        pipe = subprocess.PIPE
        running.append(subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True))
        return running[-1]

    yield run
    for process in running:
        process.kill()
        process.communicate()


@pytest.fixture
def stubs(start: Start) -> Callable[..., subprocess.Popen[str]]:
    """Two stub vehicles, when they are there."""

    def run(*words: Any) -> subprocess.Popen[str]:
        home = f"{HOME[0]},{HOME[1]},488"
        process = start("sim_vehicle_stub.cli", "--vehicles", 2, "--home", home, "--speed", SPEED, *words)
        read_until(process, "Ctrl-C ends")
        return process

    return run
