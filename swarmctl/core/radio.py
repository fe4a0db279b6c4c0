"""Radio: who hears whose beacon.  It emulates range, loss and delay; a real network takes its place.

A beacon is sent once a period and heard, after the delay, by every vehicle that was in range when it was
sent and did not lose it.  Beacons on their way lie in a ring of slots, one a period.
"""

from .arrays import Integers, Records
from .jit import kernel
from .randoms import LOSS, uniform


@kernel
def deliver(
    fleet: Records, i: int, poses: Records, rules: Records, tick: int, slot: int, heard: Integers,
    heard_count: Integers,
) -> None:  # fmt: skip
    """List in ``heard[slot, i]`` the senders that vehicle ``i`` will hear of this tick's beacons."""
    count = 0
    for j in range(poses.shape[0]):
        if j == i or count == heard.shape[2]:
            continue
        dx = poses[j].east - poses[i].east
        dy = poses[j].north - poses[i].north
        reach = min(fleet[i].radio_range, fleet[j].radio_range)
        if dx * dx + dy * dy > reach * reach:
            continue
        loss = fleet[i].radio_loss
        if loss > 0.0 and uniform(rules[0].seed, i, tick, LOSS + j) < loss:
            continue
        heard[slot, i, count] = j
        count += 1
    heard_count[slot, i] = count
