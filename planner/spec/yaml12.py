"""YAML 1.2 (core schema) into plain values, with the place of every key and value.

PyYAML's pure-Python scanner, parser and composer do the reading; this module decides what a scalar means,
because PyYAML's own YAML 1.1 rules turn `no` into False, `12:30` into 750 and leave `1e-5` a string.
The C loader is never used: it ends the process on 100 000 nested brackets.
Source: YAML 1.2.2, chapter 10.3 (core schema).
"""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from yaml.composer import Composer
from yaml.error import MarkedYAMLError
from yaml.events import AliasEvent
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.resolver import BaseResolver
from yaml.scanner import Scanner

from planner.errors import Fault, InputError

MAX_BYTES = 1_000_000  # 200 times a real spec; the pure-Python scanner reads about 0.5 MB/s
MAX_NODES = 50_000  # after aliases are expanded, so that an alias bomb stops here
MAX_DEPTH = 64  # a real spec is 6 deep; Python's own limit is 1000 frames
MAX_DIGITS = 100  # Python refuses to read integers of more than 4300 digits

Path = tuple[str | int | float, ...]
Place = tuple[int, int]

_TAG = "tag:yaml.org,2002:"
_NULL = re.compile(r"~|null|Null|NULL|")
_BOOL = re.compile(r"true|True|TRUE|false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+")
_OCTAL = re.compile(r"0o[0-7]+")
_HEX = re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_INF = re.compile(r"[-+]?\.(?:inf|Inf|INF)")
_NAN = re.compile(r"\.(?:nan|NaN|NAN)")
_SURROGATE = re.compile("[\ud800-\udfff]")

_ADVICE = (
    (r"'\\t' that cannot start", "a tab cannot stand here; use spaces"),
    (r"cannot start any token", "this sign cannot begin a value; write the text in quotes"),
    (r"mapping values are not allowed", "a ':' cannot stand here; check the indentation, or quote the text"),
    (r"sequence entries are not allowed", "a '-' cannot stand here; begin the list on a new line"),
    (r"could not find expected ':'", "a key without ':' after it; write 'key: value'"),
    (r"expected <block end>", "the indentation does not fit the lines above, or a bracket is left over"),
    (r"expected ',' or '\}'", "a ',' or '}' is missing"),
    (r"expected ',' or '\]'", "a ',' or ']' is missing"),
    (r"found unexpected end of stream", "a quotation mark is opened and never closed"),
    (r"expected the node content", "a value is missing here, or a bracket is left over"),
    (r"found undefined alias", "this alias (*) has no anchor (&) before it"),
    (r"second occurrence", "this anchor (&) is given twice"),
    (r"found unknown escape character", "unknown escape; in single quotes a backslash is plain text"),
    (r"found another document", "a second document begins here; a spec is one document"),
    (
        r"expected '<document start>'",
        "the document has already ended here; check the line and its indentation",
    ),
    (r"found undefined tag handle", "this tag (!) is unknown; remove it, or quote the text"),
)


@dataclass(frozen=True)
class Document:
    """Plain values of a YAML file and where they stand: path -> (line, column), counted from 1.

    `keys` holds the places of mapping keys, `values` those of all values; the root's path is ().
    `unread` are the parts that could not be read, each with its fault: their values are missing or None; of
    a key that stands twice the first value is there.
    """

    file: str
    value: Any
    keys: Mapping[Path, Place] = field(default_factory=dict)
    values: Mapping[Path, Place] = field(default_factory=dict)
    text: str = ""
    unread: tuple[tuple[Path, Fault], ...] = ()

    def line(self, number: int) -> str:
        """A line of the file, from 1."""
        return quoted(self.text, number)


class _UnreadableError(Exception):
    """Reading cannot go on from here."""

    def __init__(self, mark: Any, message: str) -> None:
        self.place = _of(mark)
        self.message = message


def read_yaml(data: bytes, file: str) -> Document:
    """Read the bytes of one YAML document.

    Raises InputError with the place for whatever is not a single YAML document of bounded size and depth:
    syntax errors, duplicate keys (all of them), foreign tags, merge keys, self-referencing aliases.
    """
    document = read_as_far(data, file)
    if document.unread:
        raise InputError("the file cannot be read", [fault for _, fault in document.unread])
    return document


def read_as_far(data: bytes, file: str) -> Document:
    """As `read_yaml`, but what spoils a part only is left to the caller, in `Document.unread`."""
    text = decode(data, file)
    loader: _Loader | None = None
    try:
        loader = _Loader(text)
        return _built(loader.get_single_node(), file, text)
    except _UnreadableError as stop:
        code, place, message = "P007", stop.place, stop.message
    except MarkedYAMLError as error:
        mark = _mark(error)
        code, place, message = "P003", _of(mark), _advice(error)
    except (ValueError, OverflowError, IndexError, AttributeError):
        # PyYAML lets these through for impossible escapes and endless version numbers
        mark = loader.get_mark() if loader else None
        code, place, message = "P003", _of(mark), "this cannot be read as YAML"
    raise _refusal(code, file, place, message, quoted(text, place[0]))


def decode(data: bytes, file: str) -> str:
    """Text of a UTF-8 file, or of UTF-16/32 with its byte-order mark. Raises InputError for anything else."""
    if len(data) > MAX_BYTES:
        raise _refusal(
            "P002",
            file,
            (0, 0),
            f"the file has {len(data)} bytes; a spec has less than {MAX_BYTES}. Is it the right file?",
        )
    encoding = _encoding(data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - (data.rfind(b"\n", 0, error.start) + 1) + 1
        name = encoding.removesuffix("-sig").upper()
        message = f"not {name} text (byte 0x{data[error.start]:02x} here); save the file as UTF-8"
        raise _refusal("P002", file, (line, column), message) from None
    bad = Reader.NON_PRINTABLE.search(text)
    if bad:
        line = text.count("\n", 0, bad.start()) + 1
        column = bad.start() - text.rfind("\n", 0, bad.start())
        message = f"character U+{ord(bad[0]):04X} is not text; is this a binary file?"
        raise _refusal("P002", file, (line, column), message)
    return text


def _encoding(data: bytes) -> str:
    marks = {
        codecs.BOM_UTF32_LE: "utf-32",  # before UTF-16, whose mark it begins with
        codecs.BOM_UTF32_BE: "utf-32",
        codecs.BOM_UTF16_LE: "utf-16",
        codecs.BOM_UTF16_BE: "utf-16",
    }
    return next((name for mark, name in marks.items() if data.startswith(mark)), "utf-8-sig")


def _of(mark: Any) -> Place:
    return (mark.line + 1, mark.column + 1) if mark else (0, 0)


def _refusal(code: str, file: str, place: Place, message: str, quote: str = "") -> InputError:
    return InputError("the file cannot be read", [Fault(file, *place, "", message, code, quote)])


def quoted(text: str, line: int) -> str:
    """A line of a text, from 1; nothing for 0, the whole file."""
    return next(islice(io.StringIO(text), line - 1, None), "").rstrip() if line else ""


def _advice(error: MarkedYAMLError) -> str:
    problem = error.problem or error.context or "this cannot be read as YAML"
    advice = next((text for pattern, text in _ADVICE if re.search(pattern, problem)), None)
    return f"{advice} ({problem})" if advice else problem


def _mark(error: MarkedYAMLError) -> Any:
    """Where to look: at the opening quote or bracket when the text ended without the closing one."""
    if re.search(r"end of stream|<stream end>", error.problem or "") and error.context_mark:
        return error.context_mark
    return error.problem_mark or error.context_mark


class _Loader(Reader, Scanner, Parser, Composer, BaseResolver):
    """PyYAML's stages with bounded depth and size; it leaves tags as written and resolves nothing."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)
        Composer.__init__(self)
        BaseResolver.__init__(self)
        self.depth = 0
        self.count = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """One node; stops at the first that is too deep, before the rest of the text is scanned."""
        event = self.peek_event()  # type: ignore[no-untyped-call]  # PyYAML's parser has no types
        self.count += 1
        if self.depth >= MAX_DEPTH and not isinstance(event, AliasEvent):
            raise _UnreadableError(event.start_mark, f"nested more than {MAX_DEPTH} levels deep")
        if self.count > MAX_NODES:
            raise _UnreadableError(event.start_mark, f"more than {MAX_NODES} entries")
        self.depth += 1
        try:
            return super().compose_node(parent, index)
        finally:
            self.depth -= 1

    def resolve(self, kind: Any, value: Any, implicit: Any) -> str:
        """Untagged nodes keep an empty tag; a quoted scalar is text."""
        if kind is ScalarNode and not implicit[0]:
            return _TAG + "str"
        return ""


def _built(node: Node | None, file: str, text: str) -> Document:
    builder = _Builder(file, text)
    value = None if node is None else builder.build(node, ())
    return Document(file, value, builder.keys, builder.values, text, tuple(builder.faults))


class _Builder:
    """Plain values from nodes, and the faults on the way."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        self.keys: dict[Path, Place] = {}
        self.values: dict[Path, Place] = {}
        self.faults: list[tuple[Path, Fault]] = []
        self.open: list[Node] = []
        self.count = 0

    def build(self, node: Node, path: Path) -> Any:
        self.values.setdefault(path, _place(node))
        self.count += 1
        if self.count > MAX_NODES:
            raise _UnreadableError(
                node.start_mark, f"more than {MAX_NODES} entries once every alias (*) is written out"
            )
        if any(node is parent for parent in self.open):
            raise _UnreadableError(node.start_mark, "an alias (*) inside of what it stands for never ends")
        if len(self.open) > MAX_DEPTH:
            raise _UnreadableError(node.start_mark, f"nested more than {MAX_DEPTH} levels deep")
        if isinstance(node, ScalarNode):
            return self.scalar(node, path)
        self.open.append(node)
        try:
            return self.mapping(node, path) if isinstance(node, MappingNode) else self.sequence(node, path)
        finally:
            self.open.pop()

    def sequence(self, node: Any, path: Path) -> list[Any]:
        assert isinstance(node, SequenceNode)
        self.check_tag(node, path, ("seq",))
        return [self.build(item, (*path, index)) for index, item in enumerate(node.value)]

    def mapping(self, node: MappingNode, path: Path) -> dict[Any, Any]:
        self.check_tag(node, path, ("map",))
        result: dict[Any, Any] = {}
        for key_node, value_node in node.value:
            key = self.key(key_node, path, result)
            if key is None:
                continue
            self.keys[(*path, key)] = _place(key_node)
            result[key] = self.build(value_node, (*path, key))
        return result

    def key(self, node: Node, path: Path, sofar: Mapping[Any, Any]) -> Any:
        """The key, or None after its fault has been noted."""
        if not isinstance(node, ScalarNode):
            return self.fault(node, "P005", path, "a key must be a word or a number, not a list or mapping")
        if node.value == "<<" and node.tag == "":
            return self.fault(
                node,
                "P005",
                path,
                "merge keys (<<) are not YAML 1.2; write the entries out, or use an alias (*)",
            )
        key = self.scalar(node, path)
        if key is None or isinstance(key, bool):
            return self.fault(
                node, "P005", path, f"a key must be a word or a number; write '{node.value}' in quotes"
            )
        if key in sofar:
            line = self.keys[(*path, key)][0]
            return self.fault(
                node, "P004", (*path, key), f"this key stands here twice (first in line {line}); keep one"
            )
        return key

    def scalar(self, node: ScalarNode, path: Path) -> Any:
        if _SURROGATE.search(node.value):
            return self.fault(node, "P006", path, "this escape is half of a character (a surrogate)")
        if node.tag == _TAG + "str":
            return node.value
        if len(node.value) > MAX_DIGITS and re.fullmatch(
            r"[-+]?(0x)?[0-9a-fA-F.]+([eE][-+]?[0-9]+)?", node.value
        ):
            return self.fault(
                node, "P006", path, f"a number of {len(node.value)} digits; write it like 1.5e3"
            )
        value = resolved(node.value)
        kind = {type(None): "null", bool: "bool", int: "int", float: "float"}.get(type(value), "str")
        self.check_tag(node, path, ("int", "float") if kind == "int" else (kind,))
        return float(value) if node.tag == _TAG + "float" and kind == "int" else value

    def check_tag(self, node: Node, path: Path, kinds: tuple[str, ...]) -> None:
        if node.tag in ("", "!") or node.tag in [_TAG + kind for kind in kinds]:
            return
        tag = node.tag.replace(_TAG, "!!")[:60]
        self.fault(node, "P006", path, f"tag {tag} is not understood here; remove it, or quote the text")

    def fault(self, node: Node, code: str, path: Path, message: str) -> Any:
        """Note a fault; its value is None."""
        line, column = _place(node)
        fault = Fault(self.file, line, column, shown(path), message, code, quoted(self.text, line))
        self.faults.append((path, fault))
        return None


def resolved(text: str) -> Any:
    """What a plain scalar means in the core schema: null, bool, int, float, else the text itself."""
    if _NULL.fullmatch(text):
        return None
    if _BOOL.fullmatch(text):
        return text.lower() == "true"
    if _INT.fullmatch(text):
        return int(text)
    if _OCTAL.fullmatch(text) or _HEX.fullmatch(text):
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _INF.fullmatch(text) or _NAN.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def _place(node: Node) -> Place:
    return _of(node.start_mark)


def shown(path: Path) -> str:
    """A path in the user's words: `requirement[0].limit`, `run_to_run[-55 degC]`."""
    text = ""
    for part in path:
        if isinstance(part, str) and re.fullmatch(r"[\w.-]+", part) and not part[0].isdigit():
            text += f".{part}" if text else part
        else:
            text += f"[{str(part)[:40]}]"
    return text
