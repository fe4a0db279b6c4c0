"""What is wrong with a mission, said so that the person who wrote it can mend it.

A check speaks of a place in the mission by its path of keys and returns a :class:`Finding`.  The reader knows
where each path stands in the file and turns findings into :class:`Problem`\\ s, and all of them leave the
package together in one :class:`MissionError`.
"""

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

KeyPath = tuple[str | int, ...]

COMMAND_LINE = "command line"


class Finding(NamedTuple):
    """Something wrong at ``path`` in the mission: what, and what to do about it."""

    path: KeyPath
    message: str
    hint: str = ""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing wrong: ``line`` and ``column`` count from 1 and are None where there is no line to name."""

    file: str
    line: int | None
    column: int | None
    key: str
    message: str
    hint: str = ""

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}:{self.column}"
        key = f" {self.key}:" if self.key else ""
        hint = f" ({self.hint})" if self.hint else ""
        return f"{place}:{key} {self.message}{hint}"


class MissionError(Exception):
    """A mission that cannot be used; ``problems`` holds everything that is wrong with it."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = list(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


def key_of(path: KeyPath) -> str:
    """The path as people write it: ``keep_out[1].box_m``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += f".{part}" if text else part
    return text


def shown(value: object) -> str:
    """A value as it appears in a message: short, and harmless whatever it holds."""
    text = "null" if value is None else ascii(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint that names the known word nearest to ``word``, or all of them."""
    words = sorted(known)
    close = difflib.get_close_matches(word, words, n=1)
    if close:
        return f"did you mean {close[0]}?"
    return f"known: {', '.join(words)}" if words else ""
