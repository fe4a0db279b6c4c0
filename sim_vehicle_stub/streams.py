"""Which messages are due: each has an interval, and is sent at most once each time it is asked.

Times are integer microseconds, so that ten intervals of a tenth of a second are exactly one second.
"""

from collections.abc import Mapping

NEVER_US = 1 << 62


class Streams:
    """The periodic messages of one vehicle."""

    def __init__(self, intervals_us: Mapping[int, int], now_us: int) -> None:
        self._defaults = intervals_us
        self._intervals = {
            message_id: interval for message_id, interval in intervals_us.items() if interval > 0
        }
        self._due = dict.fromkeys(self._intervals, now_us)
        self._next = now_us

    def interval_us(self, message_id: int) -> int:
        """Microseconds between two of them; -1 while it is not sent."""
        return self._intervals.get(message_id, -1)

    def set_interval(self, message_id: int, interval_us: int, now_us: int) -> None:
        """Send every ``interval_us``, from one interval after now on; 0: as at boot; negative: not at all."""
        if interval_us == 0:
            interval_us = self._defaults.get(message_id, -1)
        self._intervals.pop(message_id, None)
        self._due.pop(message_id, None)
        if interval_us > 0:
            self._intervals[message_id] = interval_us
            self._due[message_id] = now_us + interval_us
        self._next = min(self._due.values(), default=NEVER_US)

    def take_due(self, now_us: int) -> list[int]:
        """Ids of the messages to send now.  One that was due more than once is sent once."""
        if now_us < self._next:
            return []
        taken = []
        self._next = NEVER_US
        for message_id, at in self._due.items():
            if at <= now_us:
                taken.append(message_id)
                interval = self._intervals[message_id]
                at += interval * ((now_us - at) // interval + 1)
                self._due[message_id] = at
            if at < self._next:
                self._next = at
        return taken
