"""The YAML reader: plain data, marks, and what it refuses."""

import pytest

from swarmctl.mission import yaml_reader
from swarmctl.mission.errors import MissionError
from swarmctl.mission.yaml_reader import Mark


def test_data_and_marks() -> None:
    document = yaml_reader.read(b"a: 1\nb:\n  - {c: x}\n  - [2, 3.5]\n", "m.yaml")
    assert document.data == {"a": 1, "b": [{"c": "x"}, [2, 3.5]]}
    assert document.marks[("a",)] == Mark(1, 1)
    assert document.marks[("b", 0, "c")] == Mark(3, 6)
    assert document.marks[("b", 1, 1)] == Mark(4, 9)
    assert document.problems == []


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e3", 1000.0),
        ("-.5", -0.5),
        ("+12", 12),
        ("010", 10),
        ("12:30", "12:30"),
        ("on", "on"),
        ("yes", "yes"),
        ("2026-01-01", "2026-01-01"),
        ("true", True),
        ("~", None),
        ("", None),
        ("'5'", "5"),
        ("!!str 5", "5"),
    ],
)
def test_scalars_follow_yaml_1_2(text: str, value: object) -> None:
    data = yaml_reader.read(f"a: {text}\n".encode(), "m.yaml").data["a"]
    assert data == value
    assert type(data) is type(value)


def test_infinity_and_nan_are_read_as_such() -> None:
    data = yaml_reader.read(b"[.inf, -.Inf, .NaN]", "m.yaml").data
    assert data[:2] == [float("inf"), float("-inf")]
    assert data[2] != data[2]


def test_an_alias_is_a_copy_of_its_own() -> None:
    data = yaml_reader.read(b"a: &x {k: 1}\nb: *x\n", "m.yaml").data
    assert data == {"a": {"k": 1}, "b": {"k": 1}}
    assert data["a"] is not data["b"]


BOMB = b"a: &a [1,2,3,4,5,6,7,8,9]\n" + b"".join(
    b"%c: &%c [%s]\n" % (98 + k, 98 + k, b",".join([b"*%c" % (97 + k)] * 9)) for k in range(8)
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "m.yaml:1:1: the file is empty"),
        (b"# nothing but a comment\n", "m.yaml:1:1: the file is empty"),
        (b"name: x\n\xff\xfe", "m.yaml:2:1: not a text file: byte 0xff"),
        (b"name: x\n\xf0\x9f", "m.yaml:2:1: not a text file"),
        (b"ab: c\0d", "m.yaml:1:6: not a text file: character 0x00"),
        (b"a: [1,\nb: 2", "m.yaml:2:5: not valid YAML: while parsing a flow sequence, expected"),
        (b"a: 1\n b: 2", "m.yaml:2:3: not valid YAML: mapping values are not allowed here"),
        (b"a: 1\n---\nb: 2", "m.yaml:2:1: not valid YAML: expected a single document"),
        (b"\t- x", "m.yaml:1:1: not valid YAML"),
        (b"a: *b", "m.yaml:1:4: not valid YAML: found undefined alias 'b'"),
        (b"[" * 100_000, "m.yaml:1:33: not valid YAML: nested deeper than 32 levels"),
        (b"{a: " * 100_000, "not valid YAML: nested deeper than 32 levels"),
        (b"- " * 100_000, "not valid YAML: nested deeper than 32 levels"),
        (b'"\\U00999999"', "not valid YAML: an escape"),
        (b"x" * 5_000_001, "m.yaml: 5000001 bytes is too large"),
        (BOMB, "too large once its aliases are expanded"),
        (b"a: &a [*a]", "m.yaml:1:4: a: too large once its aliases are expanded"),
    ],
    ids=lambda value: value[:20].decode("latin-1") if isinstance(value, bytes) else "",
)
def test_what_is_no_yaml_is_refused(content: bytes, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml_reader, "MAX_VALUES", 50_000)
    with pytest.raises(MissionError) as caught:
        yaml_reader.read(content, "m.yaml")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a: 1\nb: 2\na: 3", "m.yaml:3:1: a: given twice, first on line 1 (keep one of them)"),
        (b"x: {a: 1, a: 1}", "m.yaml:1:11: x.a: given twice"),
        (b"a: !!python/object/apply:os.system [ls]", "m.yaml:1:4: a: the tag 'tag:yaml.org,2002:python"),
        (b"a: !!binary aGVsbG8=", "m.yaml:1:4: a: the tag"),
        (b"a: !mine {b: 1}", "m.yaml:1:4: a: the tag '!mine' is not allowed"),
        (b"5: x", "m.yaml:1:1: a key must be a word"),
        (b"[a]: x", "m.yaml:1:1: a key must be a word"),
        (b'a: "\\ud800"', "m.yaml:1:4: a: holds half a surrogate pair"),
        (b"a: " + b"9" * 5000, "m.yaml:1:4: a: a number of 5000 digits is too long"),
        (b"a: !!int x", "m.yaml:1:4: a: 'x' is not a int"),
        (b"a: !!bool x", "m.yaml:1:4: a: 'x' is not a bool"),
    ],
    ids=lambda value: value[:20].decode("latin-1") if isinstance(value, bytes) else "",
)
def test_what_is_wrong_in_yaml_is_kept_with_its_place(content: bytes, message: str) -> None:
    problems = [str(problem) for problem in yaml_reader.read(content, "m.yaml").problems]
    assert len(problems) == 1
    assert problems[0].startswith(message)


def test_a_byte_order_mark_is_no_fault() -> None:
    assert yaml_reader.read("\ufeffname: x".encode(), "m.yaml").data == {"name": "x"}
