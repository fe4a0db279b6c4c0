"""What can end a flight before its time."""


class FlightError(Exception):
    """The flight cannot begin or go on; the message says which vehicle and why."""


class RefusedError(FlightError):
    """No vehicle, too few, or one that refuses: nothing was armed."""


class StoppedError(Exception):
    """The operator stopped the program at once; the message says what that leaves behind."""
