"""YAML in, plain data out, with the line and column of every key.

PyYAML is used as far as its node tree; the data are built here, because its own constructors lose the marks,
accept duplicate keys and expand aliases without limit.  Plain scalars follow YAML 1.2 (so that `1e3` is a
number, and `on` and `12:30` are not), and no tag beyond the plain ones is accepted: nothing in a file can
run code.  Whatever the bytes, the only exception that leaves is MissionError.
"""

import re
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

from .errors import COMMAND_LINE, Finding, KeyPath, MissionError, Problem, key_of, shown

MAX_BYTES = 5_000_000
MAX_DEPTH = 32
MAX_VALUES = 500_000
MAX_NUMBER_LENGTH = 40

PLAIN = "tag:yaml.org,2002:"
SCALARS = (
    ("null", re.compile(r"^(?:~|null|Null|NULL|)$"), "~nN\0"),
    ("bool", re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$"), "tTfF"),
    ("int", re.compile(r"^[-+]?[0-9]+$"), "-+0123456789"),
    (
        "float",
        re.compile(
            r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
            r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
        ),
        "-+.0123456789",
    ),
)


class Mark(NamedTuple):
    """Where a key stands: ``line`` and ``column`` from 1; None and a key's name for the command line."""

    line: int | None
    column: int | None
    typed: str | None = None


@dataclass
class Document:
    """A file's ``data``, the mark of every path of keys in it, and what was wrong on the way."""

    file: str
    data: Any
    marks: dict[KeyPath, Mark] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def problem(self, finding: Finding) -> Problem:
        """The finding with the place of the nearest key above it that is written down."""
        path = finding.path
        while path and path not in self.marks:
            path = path[:-1]
        mark = self.marks.get(path, Mark(None, None))
        if mark.typed is not None:
            key = key_of((mark.typed, *finding.path[len(path) :]))
            return Problem(COMMAND_LINE, None, None, key, finding.message, finding.hint)
        return Problem(self.file, mark.line, mark.column, key_of(finding.path), finding.message, finding.hint)


class Loader(yaml.SafeLoader):
    """PyYAML's node composer with YAML 1.2 scalars and a limit to nesting."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012
    depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.MarkedYAMLError(problem=f"nested deeper than {MAX_DEPTH} levels", problem_mark=mark)
        node: yaml.Node | None = super().compose_node(parent, index)
        self.depth -= 1
        return node


class Dumper(yaml.SafeDumper):
    """Writes what :class:`Loader` reads back: it quotes whatever that would take for a number."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012


for _name, _pattern, _first in SCALARS:
    for _class in (Loader, Dumper):
        _class.add_implicit_resolver(
            PLAIN + _name, _pattern, ["" if letter == "\0" else letter for letter in _first]
        )


class _Builder:
    """Turns nodes into data, keeping a mark for each path and refusing what a mission has no use for."""

    def __init__(self, file: str) -> None:
        self.document = Document(file, None)
        self.problems = self.document.problems
        self.values = 0

    def fail(self, node: yaml.Node, path: KeyPath, message: str, hint: str = "") -> None:
        mark = node.start_mark
        self.problems.append(
            Problem(self.document.file, mark.line + 1, mark.column + 1, key_of(path), message, hint)
        )

    def build(self, node: yaml.Node, path: KeyPath) -> Any:
        self.values += 1
        if self.values > MAX_VALUES or len(path) > MAX_DEPTH:
            self.fail(node, path[:1], "too large once its aliases are expanded", "write it without aliases")
            raise MissionError(self.problems)
        kind = node.tag.removeprefix(PLAIN)
        if isinstance(node, yaml.MappingNode) and kind == "map":
            return self.mapping(node, path)
        if isinstance(node, yaml.SequenceNode) and kind == "seq":
            return [self.item(child, (*path, k)) for k, child in enumerate(node.value)]
        if isinstance(node, yaml.ScalarNode) and kind in ("str", "null", "bool", "int", "float"):
            return self.scalar(node, kind, path)
        self.fail(node, path, f"the tag {shown(node.tag)} is not allowed in a mission", "write a plain value")
        return None

    def item(self, node: yaml.Node, path: KeyPath) -> Any:
        self.document.marks[path] = Mark(node.start_mark.line + 1, node.start_mark.column + 1)
        return self.build(node, path)

    def mapping(self, node: yaml.MappingNode, path: KeyPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if not isinstance(key_node, yaml.ScalarNode) or key_node.tag != PLAIN + "str":
                self.fail(key_node, path, "a key must be a word")
                continue
            key = str(self.scalar(key_node, "str", path))
            place = (*path, key)
            if key in data:
                first = self.document.marks[place].line
                self.fail(key_node, place, f"given twice, first on line {first}", "keep one of them")
                continue
            self.document.marks[place] = Mark(key_node.start_mark.line + 1, key_node.start_mark.column + 1)
            data[key] = self.build(value_node, place)
        return data

    def scalar(self, node: yaml.ScalarNode, kind: str, path: KeyPath) -> Any:
        text: str = node.value
        if kind == "str":
            if any("\ud800" <= letter <= "\udfff" for letter in text):
                self.fail(node, path, "holds half a surrogate pair, which is not a character")
                return ""
            return text
        if kind == "null":
            return None
        if kind == "bool" and text.lower() in ("true", "false"):
            return text.lower() == "true"
        return self.number(node, kind, path)

    def number(self, node: yaml.ScalarNode, kind: str, path: KeyPath) -> Any:
        text = node.value
        if len(text) > MAX_NUMBER_LENGTH:
            self.fail(node, path, f"a number of {len(text)} digits is too long")
            return None
        try:
            return int(text) if kind == "int" else float(re.sub(r"\.(inf|nan)", r"\1", text.lower()))
        except ValueError:
            self.fail(node, path, f"{shown(text)} is not a {kind}")
            return None


def read(content: bytes, file: str) -> Document:
    """Data and marks of a YAML file's ``content``; ``file`` is its name in messages.

    Raises MissionError for what is no YAML at all; what is merely wrong in it (a key given twice, a tag) is
    left in ``problems``, so that it can be reported with everything else.
    """
    node = _compose(_text(content, file), file)
    if node is None:
        raise MissionError([Problem(file, 1, 1, "", "the file is empty", "missions/paper.yaml is a start")])
    builder = _Builder(file)
    document = builder.document
    document.marks[()] = Mark(node.start_mark.line + 1, node.start_mark.column + 1)
    document.data = builder.build(node, ())
    return document


def _text(content: bytes, file: str) -> str:
    if len(content) > MAX_BYTES:
        message = f"{len(content)} bytes is too large for a mission"
        raise MissionError([Problem(file, None, None, "", message, f"at most {MAX_BYTES}")])
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        before = content[: error.start]
        line, column = before.count(b"\n") + 1, error.start - before.rfind(b"\n")
        message = f"not a text file: byte 0x{content[error.start]:02x} is not UTF-8"
        raise MissionError(
            [Problem(file, line, column, "", message, "a mission is YAML, saved as UTF-8")]
        ) from None


def _compose(text: str, file: str) -> yaml.Node | None:
    line: int | None = None
    column: int | None = None
    try:
        return Loader(text).get_single_node()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        if mark is not None:
            line, column = mark.line + 1, mark.column + 1
        why = ", ".join(part for part in (error.context, error.problem) if part)
        problem = Problem(file, line, column, "", f"not valid YAML: {why}")
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        message = f"not a text file: character 0x{int(error.character):02x} is not printable"
        problem = Problem(file, line, error.position - text.rfind("\n", 0, error.position), "", message)
    except (ValueError, OverflowError):
        problem = Problem(
            file, line, column, "", "not valid YAML: an escape such as \\U00999999 names no character"
        )
    raise MissionError([problem])
