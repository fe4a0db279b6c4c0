"""A recording written again with something changed in it, through the program's own log."""

from collections.abc import Callable
from pathlib import Path

from swarmctl.record import mcap_read
from swarmctl.record.mcap_log import McapLog
from swarmctl.record.mcap_read import Rows

Change = Callable[[Rows], None]
"""Changes a message's rows where they lie."""


def rewrite(
    source: Path, target: Path, change: Change, *, chunk_bytes: int = 1 << 20, begin_s: float = 0.0
) -> None:
    """Copy the recording ``source`` to ``target``, each message of rows passed through ``change``.

    Messages before ``begin_s`` are left out, but for those of time 0, which describe the flight.
    """
    log = mcap_read.read(source)
    with McapLog(target, chunk_bytes=chunk_bytes) as copy:
        for name, text in log.attachments.items():
            copy.attach(name, text)
        for name, values in log.metadata.items():
            copy.metadata(name, values)
        for message in log.rows():
            if 0.0 < message.time_s < begin_s:
                continue
            change(message)
            channel = copy.channel(message.topic, message.rows.dtype)
            copy.write_rows(channel, message.tick, message.time_s, message.rows)
        for event in log.events():
            copy.write_json(event.topic, event.time_s, event.content)


def unchanged(message: Rows) -> None:
    """Leave a message as it is."""
