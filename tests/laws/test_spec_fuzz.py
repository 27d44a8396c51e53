"""Whatever is done to a spec's text, loading it returns a spec or raises InputError: never anything else."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InputError
from planner.spec.load import LoadedSpec, load_spec, spec_from_bytes
from planner.spec.starter import starter_text
from tests.spec.example import EXAMPLE

SPECS = [EXAMPLE, starter_text()]
SPECS += [
    path.read_text(encoding="utf-8")
    for path in sorted((Path(__file__).parents[2] / "requirements_specs").glob("*.yaml"))
]

NASTY = [
    *(
        ".nan",
        ".inf",
        "-1",
        "1e400",
        "0",
        "[]",
        "{}",
        "null",
        "~",
        "3 kg",
        "nan deg/s",
        "-1 deg/s",
        "0 deg/s",
    ),
    *(
        "1e300 m",
        "1e-300 s",
        "'",
        '"',
        "[",
        "{",
        "]",
        "}",
        "&a",
        "*a",
        "&a [*a]",
        "<<: {}",
        "!!python/name:os x",
    ),
    *(
        "!!binary aGk=",
        "[" * 200,
        "{a: " * 90,
        "- " * 90,
        "9" * 5000,
        "0x" + "f" * 5000,
        "2026-02-31",
        "12:30",
    ),
    *(
        "yes",
        "true",
        "|",
        ">",
        "%",
        "@",
        "`",
        "? x",
        ": x",
        "x: y: z",
        "--- x",
        "...",
        "# x",
        "\t",
        "\u2028",
        "\x85",
    ),
    *(
        "degC",
        "5 degC",
        "-300 degC",
        "room",
        "simulated",
        "{curve: {}}",
        "{1: 1, 1: 2}",
        "{-1: 1 m}",
        "{file: .}",
    ),
    *(
        "{file: ../../..}",
        "{name: level, speed: x}",
        "{given: {}}",
        "{given: {x: 1 m}}",
        "[[], {}]",
        "[null]",
        "1",
    ),
    *('"\\ud800"', '"\\0"', '"\\UFFFFFFFF"', "é" * 300, "a" * 3000, "-0.0", "1e15", "18446744073709551616"),
]
SPEC = Path("spec.yaml")
BYTES = [b"\x00", b"\xff", b"\xfe\xff", b"\x1b[31m", b"\r", b"\xc3", b"\xed\xa0\x80", b"\xef\xbb\xbf"]


def survives(data: bytes, path: Path = SPEC, load: Callable[[Path], LoadedSpec] | None = None) -> None:
    """The one law. A refusal has faults, each with a message, that can be printed."""
    try:
        assert isinstance(load(path) if load else spec_from_bytes(data, path), LoadedSpec)
        return
    except InputError as error:
        refusal = error
    assert refusal.faults
    assert all(fault.message and fault.file == str(path) for fault in refusal.faults)
    str(refusal).encode()  # what cannot be printed would end in a traceback later


def mutated(text: str, dice: random.Random) -> bytes:
    """One to three random accidents."""
    for _ in range(dice.randint(1, 3)):
        lines = text.split("\n")
        at = dice.randrange(len(lines))
        kind = dice.randrange(9)
        if kind == 0:
            del lines[at]
        elif kind == 1:
            lines.insert(at, lines[dice.randrange(len(lines))])
        elif kind == 2:
            lines[at] = lines[dice.randrange(len(lines))]
        elif kind == 3:
            lines[at] = lines[at][dice.randint(0, 4) :] if dice.random() < 0.5 else "\t" + lines[at]
        elif kind == 4:
            lines[at] = f"{lines[at].partition(':')[0]}: {dice.choice(NASTY)}"
        elif kind == 5:
            words = lines[at].split(" ")
            words[dice.randrange(len(words))] = dice.choice(NASTY)
            lines[at] = " ".join(words)
        elif kind == 6:
            lines = lines[:at]
        elif kind == 7:
            where = dice.randint(0, len(lines[at]))
            lines[at] = lines[at][:where] + dice.choice("[]{}:,-#&*!|>'\"%@ \t0e.") + lines[at][where:]
        else:
            lines[at] = lines[at].replace(dice.choice("0123456789.:,[]{} "), dice.choice("09.:-[]{} "))
        text = "\n".join(lines)
    data = bytearray(text.encode("utf-8", "replace"))
    if data and dice.random() < 0.1:
        at = dice.randrange(len(data))
        data[at : at + dice.randint(0, 3)] = dice.choice(BYTES)
    return bytes(data)


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1, 2, 3])
def test_random_accidents(seed: int) -> None:
    dice = random.Random(seed)
    for _ in range(300):
        survives(mutated(dice.choice(SPECS), dice))


def test_every_value_of_the_example_made_nasty_in_turn() -> None:
    dice = random.Random(0)
    for line in EXAMPLE.splitlines():
        key, colon, _ = line.partition(":")
        for value in dice.sample(NASTY, 12) if colon else ():
            survives(EXAMPLE.replace(line, f"{key}: {value}").encode("utf-8", "replace"))


def test_every_truncation_at_a_byte() -> None:
    data = EXAMPLE.encode()
    for end in range(0, len(data), 17):
        survives(data[:end])


@given(st.binary(max_size=200))
@settings(deadline=None, max_examples=100)
def test_any_bytes(data: bytes) -> None:
    survives(data)


@given(st.text(alphabet="abgr:-[]{}&*!|>'\"%#? \n\t012.", max_size=120))
@settings(deadline=None, max_examples=150)
def test_any_text_of_yamls_own_signs(text: str) -> None:
    survives(text.encode())


leaves = (
    st.none()
    | st.booleans()
    | st.integers(-3, 10**20)
    | st.floats()
    | st.sampled_from(NASTY)
    | st.text(max_size=5)
)
keys = st.sampled_from(
    ["bias", "bench", "name", "file", "curve", "gyro", "range", "-55 degC", "x", "static", "least"]
)


@given(
    st.sampled_from(
        ["requirement", "trajectory", "sensitivities", "unit", "effects", "benches", "tests", "plan", "name"]
    ),
    st.recursive(
        leaves, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3)
    ),
)
@settings(deadline=None, max_examples=100)
def test_any_value_in_any_section(section: str, value: object) -> None:
    import yaml

    document = yaml.safe_load(EXAMPLE)
    document[section] = value
    survives(yaml.safe_dump(document, allow_unicode=True).encode("utf-8", "replace"))


def test_from_a_file_as_well(tmp_path: Path) -> None:
    dice = random.Random(99)
    file = tmp_path / "spec.yaml"
    for _ in range(50):
        data = mutated(EXAMPLE, dice)
        file.write_bytes(data)
        survives(data, file, load_spec)
