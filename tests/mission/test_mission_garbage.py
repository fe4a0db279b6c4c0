"""Whatever a mission file holds, either a mission or a MissionError comes of it."""

from collections.abc import Callable
from importlib import resources

import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swarmctl.mission.errors import MissionError
from swarmctl.mission.model import Mission

Read = Callable[..., Mission]
PAPER = (resources.files("missions") / "paper.yaml").read_bytes()
FEW = settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def survives(read: Read, content: bytes, overrides: dict[str, object] | None = None) -> None:
    try:
        assert isinstance(read(content, overrides), Mission)
    except MissionError as error:
        assert error.problems
        assert all(problem.message and "\n" not in problem.message for problem in error.problems)


@given(st.binary(max_size=200))
@FEW
def test_bytes(read: Read, content: bytes) -> None:
    survives(read, content)


@given(st.text(alphabet="[]{}:,-&*!|>'\"%@`#? \n\tab1.", max_size=60))
@FEW
def test_punctuation(read: Read, text: str) -> None:
    survives(read, text.encode())


@given(st.integers(0, len(PAPER) - 1), st.binary(min_size=1, max_size=3), st.integers(0, 20))
@FEW
def test_a_damaged_mission(read: Read, place: int, patch: bytes, gap: int) -> None:
    survives(read, PAPER[:place] + patch + PAPER[place + gap :])


KEYS = st.sampled_from(sorted({*Mission.model_fields, "polygon", "polygon_m", "file", "count", "launch"}))
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.floats(-100, 100),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(KEYS | st.text(max_size=4), inner, max_size=3)
    ),
    max_leaves=12,
)


@given(st.dictionaries(KEYS, VALUES, max_size=4))
@FEW
def test_wrong_values(read: Read, data: dict[str, object]) -> None:
    survives(read, yaml.safe_dump(data, allow_unicode=True).encode("utf-8", "surrogatepass"))


@given(st.lists(st.lists(st.floats(-200, 200), min_size=2, max_size=2), max_size=8))
@FEW
def test_wild_polygons(read: Read, points: list[list[float]]) -> None:
    text = yaml.safe_dump({"area": {"polygon_m": points}, "keep_out": [{"polygon_m": points[::-1]}]})
    survives(read, text.encode())
    survives(read, yaml.safe_dump({"area": {"polygon_m": points}, "safety": {"fence_margin_m": 1}}).encode())
    survives(read, yaml.safe_dump({"keep_out": [{"polygon_m": points}]}).encode())


@given(st.dictionaries(st.lists(KEYS | st.text(max_size=3), max_size=4).map(".".join), VALUES, max_size=3))
@FEW
def test_wild_settings(read: Read, overrides: dict[str, object]) -> None:
    survives(read, PAPER, overrides)
    survives(read, b"vehicles: [{}, {launch: [100, 100]}]\nname: 5", overrides)
