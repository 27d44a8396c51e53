"""The page of sources names every table of K, and nothing that is not there."""

import re
from pathlib import Path

from planner.cli import app

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "planner" / "docs" / "sources.md").read_text(encoding="utf-8")
TABLES = [(1, 10), (2, 19), (3, 3), (4, 9)]  # chapter -> its last table


FIGURES = [(1, 11), (2, 24), (3, 20), (4, 12)]
DRAWN = {(1, 1), (2, 1), (2, 2), (2, 3), (2, 4), (3, 1), (3, 2), (3, 6)}  # schemes of a method, no result


def named(what: str = "[Tt]able") -> set[tuple[int, int]]:
    """Chapter and number of tables behind `table` or `tables`, ranges spelled out; figures alike."""
    found = set()
    for text in re.findall(what + r"s? ((?:\d\.\d+[-, and]*)+)", PAGE):
        for first, last in re.findall(r"(\d\.\d+)(?:-(\d\.\d+))?", text):
            chapter, start = map(int, first.split("."))
            end = int(last.split(".")[1]) if last else start
            found |= {(chapter, k) for k in range(start, end + 1)}
    return found


def test_every_table_of_the_thesis_is_accounted_for():
    assert {(c, k) for c, last in TABLES for k in range(1, last + 1)} <= named()


def test_every_figure_of_the_thesis_that_is_a_result_is_accounted_for():
    every = {(c, k) for c, last in FIGURES for k in range(1, last + 1)}
    assert every - DRAWN <= named("[Ff]ig(?:ure)?")


def test_what_the_page_points_at_is_there():
    paths = set(re.findall(r"(?:tests|benchmarks|requirements_specs)/[\w/]+\.(?:py|yaml)", PAGE))
    assert len(paths) > 20
    assert [p for p in paths if not (ROOT / p).is_file()] == []
    commands = set(re.findall(r"`planner (\w+)", PAGE))
    assert commands <= {c.callback.__name__ for c in app.registered_commands if c.callback}
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "planner/docs/sources.md" in readme
