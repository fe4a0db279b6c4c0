"""Record types survive the way through ROS 1 message definitions; what ROS 1 cannot hold is refused."""

import numpy as np
import pytest
from hypothesis import given

from swarmctl.core import state
from swarmctl.record.ros1 import Dtype, dtype_of, ros1_definition, rows_definition, rows_dtype

from .record_types import RECORD_TYPES

HEADER = "uint64 tick\n"


@given(RECORD_TYPES)
def test_a_type_is_rebuilt_from_its_definition(dtype: Dtype) -> None:
    assert dtype_of(ros1_definition(dtype)) == dtype
    assert rows_dtype(rows_definition(dtype, HEADER), HEADER) == dtype


@pytest.mark.parametrize("name", ["VEHICLE", "POSE", "KNOWLEDGE", "BEACON", "SETPOINT", "PATH", "ERRAND"])
def test_the_records_of_the_loop_are_all_held(name: str) -> None:
    dtype: Dtype = getattr(state, name)
    assert dtype_of(ros1_definition(dtype)) == dtype


def test_a_definition_reads_as_ros_writes_it() -> None:
    place = np.dtype([("east", "<f8"), ("north", "<f8")])
    dtype = np.dtype([("id", "<i4"), ("best", place), ("ways", place, (2,)), ("grid", "<f4", (2, 3))])
    assert ros1_definition(dtype).splitlines() == [
        "int32 id",
        "swarmctl/Best best",
        "swarmctl/Ways[2] ways",
        "float32[6] grid  # shape 2x3",
        "=" * 80,
        "MSG: swarmctl/Best",
        "float64 east",
        "float64 north",
        "=" * 80,
        "MSG: swarmctl/Ways",
        "float64 east",
        "float64 north",
    ]


def test_fields_of_one_name_and_different_types_are_told_apart() -> None:
    one = np.dtype([("best", np.dtype([("x", "<f8")]))])
    two = np.dtype([("best", np.dtype([("y", "<i2")]))])
    dtype = np.dtype([("a", one), ("b", two)])
    assert dtype_of(ros1_definition(dtype)) == dtype


@pytest.mark.parametrize(
    "dtype",
    [
        np.dtype([("x", ">f8")]),
        np.dtype([("x", "<f2")]),
        np.dtype([("x", "<c16")]),
        np.dtype([("x", "S3")]),
        np.dtype([("x", "O")]),
        np.dtype([("x", "<M8[s]")]),
        np.dtype([("x", "<f8", (0,))]),
        np.dtype([("x y", "<f8")]),
        np.dtype([("größe", "<f8")]),
        np.dtype([("x", "u1"), ("y", "<f8")], align=True),
        np.dtype({"names": ["x"], "formats": ["<f8"], "itemsize": 16}),
        np.dtype({"names": ["x", "y"], "formats": ["<f8", "<f8"], "offsets": [0, 0]}),
        np.dtype({"names": ["x", "y"], "formats": ["<f8", "<f8"], "offsets": [8, 0]}),
        np.dtype([]),
        np.dtype("<f8"),
    ],
)
def test_what_ros_cannot_hold_is_refused(dtype: Dtype) -> None:
    with pytest.raises(ValueError, match=r"."):
        ros1_definition(dtype)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "float64",
        "string name",
        "float64[] values",
        "time stamp",
        "other/Thing x",
        "float64 x  # shape",
        "swarmctl/A a\n" + "=" * 80 + "\nMSG: swarmctl/A\nswarmctl/A a\n",
    ],
)
def test_definitions_of_other_things_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        dtype_of(text)


@pytest.mark.parametrize(
    "text", ["float64[] rows", HEADER, f"{HEADER}float64[3] rows", f"{HEADER}float64[] r"]
)
def test_messages_that_are_not_rows_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"."):
        rows_dtype(text, HEADER)
