"""The table's and the chamber's languages, written down once more: strict, and not planner's own."""

from __future__ import annotations

import re

NUMBER = r"-?(?:0|[1-9]\d*)(?:\.\d{1,6})?"
AXIS = r"[1-6]"
TABLE = re.compile(
    rf":Interlock:(?:Reset|Close) ALL|:Mode:Off ALL|:Mode:(?:Position|Rate) {AXIS}"
    rf"|:Demand:(?:Position|Rate) {AXIS},{NUMBER}|:Limit:(?:Rate|Acceleration) [pr],{AXIS},{NUMBER}"
)
HOST = re.compile(r"(Power ON|Power OFF|Pusk|:[^|]+)\|(0|[1-9]\d*)")
DELAY = re.compile(rf"Delay ({NUMBER})")
CHAMBER = re.compile(r"(POWER,ON|MODE,CONSTANT|TEMP\?|TEMP,S-?(?:0|[1-9]\d{0,2})\.\d)\|(0|[1-9]\d*)")
COMMENT = re.compile(r"# [a-z0-9_]+: .+")


def body(text: str) -> list[str]:
    """The lines after the comments at the top; every line ends with one newline and is ASCII."""
    assert text.isascii()
    assert text.endswith("\n")
    lines = text[:-1].split("\n")
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    assert all(COMMENT.fullmatch(line) for line in lines[:head])
    return lines[head:]


def host(text: str) -> list[tuple[str, int]]:
    """(command, delay in ms) of a host script; an AssertionError names the first line that is wrong."""
    found = []
    for line in body(text):
        match = HOST.fullmatch(line)
        assert match, line
        assert not match[1].startswith(":") or TABLE.fullmatch(match[1]), line
        found.append((match[1], int(match[2])))
    return found


def macro(texts: list[str]) -> list[tuple[str, float]]:
    """(command, 0) and ("Delay", seconds) of a macro in one or several messages of at most 32 KB."""
    found = []
    for text in texts:
        assert len(text.encode()) <= 32 * 1024
        for line in body(text):
            delay = DELAY.fullmatch(line)
            assert delay or TABLE.fullmatch(line), line
            found.append(("Delay", float(delay[1])) if delay else (line, 0.0))
    return found


def chamber(text: str) -> list[tuple[str, int]]:
    """(command, delay in ms) of a chamber script."""
    found = []
    for line in body(text):
        match = CHAMBER.fullmatch(line)
        assert match, line
        found.append((match[1], int(match[2])))
    return found
