"""Hypothesis strategies for packed record types and arrays of them."""

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarmctl.record.ros1 import SCALARS, Dtype

NAMES = st.sampled_from(["east", "north_m", "seen", "best", "V", "a_b", "aB", "id", "memory", "x1"])
SHAPES = st.sampled_from([(), (), (1,), (3,), (2, 3), (1, 1, 2)])


def _record(fields: list[tuple[str, Dtype, tuple[int, ...]]]) -> Dtype:
    return np.dtype([(name, base, shape) if shape else (name, base) for name, base, shape in fields])


def _records_of(children: st.SearchStrategy[Dtype]) -> st.SearchStrategy[Dtype]:
    field = st.tuples(NAMES, children, SHAPES)
    return st.lists(field, min_size=1, max_size=5, unique_by=lambda entry: entry[0]).map(_record)


SCALAR_TYPES = st.sampled_from(list(SCALARS.values())).map(np.dtype)
RECORD_TYPES = st.recursive(_records_of(SCALAR_TYPES), _records_of, max_leaves=6)


def filled(dtype: Dtype, count: int, seed: int) -> NDArray[np.void]:
    """``count`` records of random bytes; bools are made 0 or 1, as both NumPy and ROS hold them."""
    noise = np.random.default_rng(seed).integers(0, 256, count * dtype.itemsize, dtype=np.uint8)
    rows = np.frombuffer(bytearray(noise.tobytes()), dtype)
    _settle_bools(rows)
    return rows


def _settle_bools(rows: NDArray[np.void]) -> None:
    for name in rows.dtype.names or ():
        column = rows[name]
        if column.dtype.names:
            _settle_bools(column)
        elif column.dtype == np.bool_:
            rows[name] = (column.view(np.uint8) & 1).astype(np.bool_)
