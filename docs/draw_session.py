"""Writes docs/session.md from the session's table: python docs/draw_session.py"""

from pathlib import Path

from swarmctl.vehicle.phases import mermaid

TEXT = """# The session's state machine

Drawn from the table in `swarmctl/vehicle/phases.py` by `docs/draw_session.py`; a test keeps it current. An arrow is
labelled with what happened and, behind the slash, what the session does.

```mermaid
{diagram}```
"""


def content() -> str:
    """What docs/session.md has to hold."""
    return TEXT.format(diagram=mermaid())


if __name__ == "__main__":
    Path(__file__).with_name("session.md").write_text(content())
