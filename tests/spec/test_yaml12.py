"""YAML 1.2.2, chapter 10.3: what a scalar means; and what no spec may contain."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from planner.errors import InputError
from planner.spec.yaml12 import MAX_DEPTH, read_yaml, shown
from tests.work import calls


def value(text: str) -> object:
    return read_yaml(f"a: {text}".encode(), "f.yaml").value["a"]


def refusal(data: str | bytes) -> list[tuple[int, int, str, str]]:
    with pytest.raises(InputError) as error:
        read_yaml(data if isinstance(data, bytes) else data.encode(), "f.yaml")
    return [(fault.line, fault.column, fault.path, fault.message) for fault in error.value.faults]


@pytest.mark.parametrize(
    ("text", "meaning"),
    [
        ("no", "no"),
        ("yes", "yes"),
        ("on", "on"),
        ("off", "off"),
        ("y", "y"),
        ("true", True),
        ("False", False),
        ("1e-5", 1e-5),
        ("1E5", 1e5),
        (".5", 0.5),
        ("1.", 1.0),
        ("-0.5e+3", -500.0),
        ("12:30", "12:30"),
        ("1:2:3", "1:2:3"),
        ("010", 10),
        ("0o17", 15),
        ("0x1F", 31),
        ("0b11", "0b11"),
        ("1_000", "1_000"),
        ("-7", -7),
        ("2026-11-21", "2026-11-21"),
        ("2026-02-31", "2026-02-31"),
        ("~", None),
        ("null", None),
        ("Null", None),
        ("nil", "nil"),
        ("''", ""),
        ("'1'", "1"),
        ('"no"', "no"),
        ("!!str 1", "1"),
        ("!!float 3", 3.0),
        ("95 %", "95 %"),
        ("=", "="),
    ],
)
def test_scalars_follow_the_core_schema(text: str, meaning: object) -> None:
    found = value(text)
    assert found == meaning
    assert type(found) is type(meaning)


def test_not_a_number_and_infinity_are_floats() -> None:
    assert math.isnan(value(".nan"))
    assert value("-.inf") == -math.inf


def test_an_alias_is_what_it_stands_for() -> None:
    document = read_yaml(b"a: &x {b: 1}\nc: *x\n", "f.yaml")
    assert document.value == {"a": {"b": 1}, "c": {"b": 1}}
    assert document.value["a"] is not document.value["c"]


def test_every_key_and_value_has_its_place() -> None:
    document = read_yaml(b"a:\n  - {b: 1}\n  - 2\n", "f.yaml")
    assert document.keys[("a", 0, "b")] == (2, 6)
    assert document.values[("a", 0, "b")] == (2, 9)
    assert document.values[("a", 1)] == (3, 5)


def test_every_duplicate_key_is_a_fault() -> None:
    found = refusal("a: 1\nb: {c: 1, c: 2}\na: 2\n3: x\n03: y")
    assert [(line, column, path) for line, column, path, _ in found] == [
        (2, 11, "b.c"),
        (3, 1, "a"),
        (5, 1, "[3]"),
    ]
    assert "first in line 1" in found[1][3]


@pytest.mark.parametrize(
    ("data", "line", "column", "words"),
    [
        ("a: &x [*x]", 1, 4, "never ends"),
        ("a: &x {b: *x}", 1, 4, "never ends"),
        ("a: !!python/object/apply:os.system [ls]", 1, 4, "tag"),
        ("a: !<tag:yaml.org,2002:python/name:os> x", 1, 4, "tag"),
        ("a: !!timestamp 2026-11-21", 1, 4, "tag"),
        ("a: {<<: {b: 1}}", 1, 5, "merge keys"),
        ("a: 1\n---\nb: 2", 2, 1, "second document"),
        ("a:\n\t- 1", 2, 1, "tab"),
        ("a: 1\n\tb: 2", 2, 1, "tab"),
        ("a: 'x\nb: 1", 1, 4, "never closed"),
        ("a: [1, 2\nb: 1", 2, 2, "is missing"),
        ("a: {b: 1", 1, 4, "is missing"),
        ("a: b: c", 1, 5, "':' cannot stand here"),
        ("- a\nb: 1", 2, 1, "indentation"),
        ("a: *nobody", 1, 4, "no anchor"),
        ("a: @x", 1, 4, "quotes"),
        ('a: "\\q"', 1, 6, "escape"),
        ('a: "\\ud800"', 1, 4, "surrogate"),
        ('a: "\\UFFFFFFFF"', 1, 7, "YAML"),
        ("? [a]\n: 1", 1, 3, "a key must be"),
        ("true: 1", 1, 1, "quotes"),
        ("~: 1", 1, 1, "quotes"),
        ("a: " + "9" * 5000, 1, 4, "5000 digits"),
        ("a: 0x" + "f" * 5000, 1, 4, "digits"),
        ("%YAML " + "1" * 5000 + ".1\n---\na: 1", 1, 7, "YAML"),
        (b"a: 1\nb: \xff", 2, 4, "UTF-8"),
        (b"a: 1\nb: \x00", 2, 4, "binary"),
        (b"\x89PNG\r\n\x1a\n\0", 1, 1, "UTF-8"),
        ("a: 1".encode("utf-16-le"), 1, 2, "binary"),
    ],
)
def test_a_refusal_has_its_place_and_a_remedy(data: str | bytes, line: int, column: int, words: str) -> None:
    found = refusal(data)
    assert (found[0][0], found[0][1]) == (line, column)
    assert words in found[0][3]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_text_with_a_byte_order_mark_is_read(encoding: str) -> None:
    assert read_yaml("a: °".encode(encoding), "f.yaml").value == {"a": "°"}


@pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "? ", "[{a: "])
def test_a_hundred_thousand_levels_are_refused_at_once(opening: str) -> None:
    found = refusal(opening * 100_000)
    assert "levels deep" in found[0][3] or "bytes" in found[0][3]
    # without the guard the scanner alone needs minutes; with it nothing below the deepest level is read, and
    # the few calls more or less are memory that is given back
    assert calls(lambda: refusal(opening * 100_000)) < 1.1 * calls(lambda: refusal(opening * 10_000))


def test_the_deepest_nesting_allowed_is_read() -> None:
    assert read_yaml(("[" * MAX_DEPTH + "]" * MAX_DEPTH).encode(), "f.yaml").value


def alias_bomb(names: str) -> str:
    """Ten to the power of the number of names, entries written out."""
    lines = [f"a: &a [{', '.join('1' * 10)}]"]
    return "\n".join(
        lines + [f"{new}: &{new} [{', '.join([f'*{old}'] * 10)}]" for old, new in pairwise(names)]
    )


def test_an_alias_bomb_is_refused_at_once() -> None:
    bomb, more = alias_bomb("abcdefghij"), alias_bomb("abcdefghijklmnopqrst")
    assert "alias" in refusal(bomb)[0][3]
    # written out, the second has 10^10 times the entries; refused, it is the reading of ten lines more
    assert calls(lambda: refusal(more)) < 1.1 * calls(lambda: refusal(bomb))


def test_files_too_large_to_be_a_spec_are_refused() -> None:
    assert "bytes" in refusal(b"#" * 5_000_000)[0][3]
    assert "entries" in refusal("[" + "1," * 60_000 + "]")[0][3]


def test_paths_are_in_the_users_words() -> None:
    assert shown(("requirement", 0, "limit")) == "requirement[0].limit"
    assert shown(("unit", "gyro", "bias", "run_to_run", "-55 degC")) == "unit.gyro.bias.run_to_run[-55 degC]"
    assert shown(("temperature_residual", 3)) == "temperature_residual[3]"
    assert shown(()) == ""
