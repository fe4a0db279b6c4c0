"""The command `sim-vehicle-stub` as tests start it."""

import contextlib
import subprocess
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def running(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """The command in a process of its own, which is ended in the end."""
    process = subprocess.Popen(
        [sys.executable, "-m", "sim_vehicle_stub.cli", *arguments], stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def line_with(process: subprocess.Popen[str], text: str) -> str:
    """The next line that the command prints with this text in it."""
    assert process.stderr is not None
    return next(line for line in process.stderr if text in line)
