"""The table's language, read strictly: what is not surely right on every controller is refused.

A message is one frame of commands joined by `;`. A command is `:Word:Word`, a space, and its arguments with
commas between them; a query has `?` after the last word. Words are case-insensitive, whole or in their short
form (the first four letters, or three when the fourth is a vowel: `:DEM:POS 1,90`), nothing between.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

LONGEST_MESSAGE = 32 * 1024  # bytes

Kind = Literal["axis", "one_axis", "mode", "number"]

COMMANDS: dict[str, tuple[Kind, ...]] = {
    "Mode:Position": ("axis",),
    "Mode:Rate": ("axis",),
    "Mode:Off": ("axis",),
    "Demand:Position": ("axis", "number"),
    "Demand:Rate": ("axis", "number"),
    "Limit:Rate": ("mode", "axis", "number"),
    "Limit:Acceleration": ("mode", "axis", "number"),
    "Interlock:Reset": ("axis",),
    "Interlock:Close": ("axis",),
    "Read:Position?": ("one_axis",),
    "Read:Rate?": ("one_axis",),
    "Status:ECP?": ("one_axis",),
}

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?")
_COMMAND = re.compile(r"(?P<header>[*:][A-Za-z:*]*\??)(?: +(?P<arguments>\S.*))?")


class GrammarError(ValueError):
    """A message that the table does not understand, and why."""


@dataclass(frozen=True)
class Command:
    """One command; axis 0 is ALL. mode: `p` or `r`; value in deg, deg/s or deg/s²."""

    name: str
    axis: int
    mode: str | None = None
    value: float | None = None

    @property
    def is_query(self) -> bool:
        """Whether it asks for a reply."""
        return self.name.endswith("?")


@lru_cache(maxsize=1024)  # a runner asks the same few questions a hundred thousand times
def parse(message: str, axes: int) -> tuple[Command, ...]:
    """The commands of one frame for a table of `axes` axes. Raises GrammarError; then none is to be done."""
    if len(message.encode()) > LONGEST_MESSAGE:
        raise GrammarError(f"message longer than {LONGEST_MESSAGE} bytes")
    if not message.isascii() or not message.isprintable():
        raise GrammarError("not plain ASCII")
    return tuple(_command(part.strip(" "), axes) for part in message.split(";"))


def short_form(word: str) -> str:
    """The short form of a word: four letters, three when the fourth is a vowel."""
    return word[:3] if word[3:4].lower() in "aeiou" else word[:4]


def _command(text: str, axes: int) -> Command:
    match = _COMMAND.fullmatch(text)
    if match is None:
        raise GrammarError(f"not a command: {text!r}")
    name = _name(match["header"])
    kinds, given = COMMANDS[name], (match["arguments"] or "").split(",")
    if len(given) != len(kinds):
        raise GrammarError(f"{name} takes {len(kinds)} arguments: {text!r}")
    found = {kind: _argument(kind, word.strip(" "), axes) for kind, word in zip(kinds, given, strict=True)}
    axis = found.get("axis", found.get("one_axis"))
    mode, value = found.get("mode"), found.get("number")
    return Command(
        name,
        int(axis or 0),
        mode if isinstance(mode, str) else None,
        float(value) if value is not None else None,
    )


def _name(header: str) -> str:
    return _named(header, tuple(COMMANDS))


@lru_cache(maxsize=256)
def _named(header: str, known: tuple[str, ...]) -> str:
    words = header.lower().removeprefix(":").split(":")
    if header.startswith(":"):
        for name in known:
            if len(words) == name.count(":") + 1 and all(map(_is, words, name.split(":"))):
                return name
    raise GrammarError(f"unknown header {header!r}")


def _is(word: str, name: str) -> bool:
    stem, query = name.removesuffix("?"), "?" * name.endswith("?")
    return word in (f"{stem}{query}".lower(), f"{short_form(stem)}{query}".lower())


def _argument(kind: Kind, word: str, axes: int) -> float | str:
    if kind == "mode":
        if word.lower() in ("p", "r"):
            return word.lower()
    elif kind == "number":
        if _NUMBER.fullmatch(word):
            return float(word)
    elif kind == "axis" and word.lower() == "all":
        return 0
    elif word.isdigit() and len(word) == 1 and 1 <= int(word) <= axes:
        return int(word)
    raise GrammarError(f"wrong {kind.replace('_', ' ')} {word!r}")
