"""Reading what processes of live flights say, and what they come to."""

import json
import subprocess
from collections.abc import Callable
from typing import Any

HOME = (47.397742, 8.545594)
SPEED = "10"
PATIENCE_S = 120
Start = Callable[..., subprocess.Popen[str]]


def read_until(process: subprocess.Popen[str], word: str) -> str:
    """Read stderr until a line holds ``word``; that line."""
    assert process.stderr is not None
    seen = []
    for line in process.stderr:
        seen.append(line)
        if word in line:
            return line
    raise AssertionError(f"{word!r} was never said: {seen}")


def flown(process: subprocess.Popen[str]) -> tuple[int, dict[str, Any]]:
    """Wait for a flight's end: exit code and summary."""
    out, err = process.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in err, err
    assert out, err
    return process.returncode, json.loads(out)
