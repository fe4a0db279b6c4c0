"""``--set``: YAML values between commas, and every combination of them."""

import pytest

from swarmctl.study.errors import StudyError
from swarmctl.study.settings import Axis, grid, read_axes, shown


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("planner.inertia=0.1,0.2", "planner.inertia", (0.1, 0.2)),
        ("radio.range_m=0, 600,1e3", "radio.range_m", (0, 600, 1000.0)),
        ("dynamics=ideal,multicopter", "dynamics", ("ideal", "multicopter")),
        ("radio.bandwidth_bps=null,9600", "radio.bandwidth_bps", (None, 9600)),
        ("stub.wind_mps=[1,2],[3, 4]", "stub.wind_mps", ([1, 2], [3, 4])),
        ("name='a,b',c", "name", ("a,b", "c")),
        ('name="a,b"', "name", ("a,b",)),
        ("targets={count: 5, clusters: 1}", "targets", ({"count": 5, "clusters": 1},)),
        ("name=a=b", "name", ("a=b",)),
        (" duration_s = 5", "duration_s", (5,)),
    ],
)
def test_values_are_yaml_between_commas(text: str, key: str, values: tuple[object, ...]) -> None:
    assert read_axes([text]) == [Axis(key, values)]


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["planner.inertia"], "write KEY=VALUE"),
        (["=5"], "write KEY=VALUE"),
        (["planner.inertia="], "no value is given"),
        (["planner.inertia=1,,2"], "not valid YAML"),
        (["stub.wind_mps=[1,2"], "not valid YAML"),
        (["name=!!python/object:os.system x"], "not allowed"),
        (["name=a,b,a"], "a value is given twice"),
        (["a=1", "b=2", "a=3"], "--set a: given twice"),
        (["planner.algorithm=fco,mdc"], "--algo"),
    ],
)
def test_what_cannot_be_read_is_told(texts: list[str], words: str) -> None:
    with pytest.raises(StudyError, match=words):
        read_axes(texts)


def test_the_grid_has_every_combination_the_last_key_fastest() -> None:
    cells = grid(read_axes(["a=1,2", "b=x,y,z", "c=0"]))
    assert [shown(cell) for cell in cells] == [f"a={a}, b={b}, c=0" for a in (1, 2) for b in ("x", "y", "z")]


def test_without_keys_there_is_one_setting_and_it_is_empty() -> None:
    assert grid([]) == [{}]


def test_values_are_shown_as_typed() -> None:
    text = "a=0.1, b=null, c=true, d=[1, 2], e=600"
    assert shown({"a": 0.1, "b": None, "c": True, "d": [1, 2], "e": 600.0}) == text
