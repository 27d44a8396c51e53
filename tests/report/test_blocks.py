"""One report, three readers: console, page and plain data say the same; pictures are the page's alone."""

from __future__ import annotations

import io
import json
import re
import sys
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from planner.commands.output import invocation
from planner.report.blocks import (
    Bar,
    Difference,
    Fact,
    Folded,
    Items,
    Picture,
    Report,
    Section,
    Table,
    Text,
    Verdict,
    table,
    tree,
)
from planner.report.console import show
from planner.report.page import html

# letters only: blanks at the ends would be dropped, some signs are replaced
words = st.text(st.characters(categories=["L"], max_codepoint=0x4FF), min_size=1, max_size=12)
where = st.sampled_from([None, "page", "console"])


def tables() -> st.SearchStrategy[Table]:
    return st.integers(1, 4).flatmap(
        lambda n: st.builds(
            Table,
            caption=words,
            columns=st.tuples(*[words] * n),
            rows=st.lists(st.tuples(*[words] * n), min_size=1, max_size=4).map(tuple),
            only=where,
        )
    )


blocks = st.one_of(
    tables(),
    st.builds(Text, words, where),
    st.builds(Items, st.lists(words, min_size=1, max_size=3).map(tuple), words, where),
    st.builds(Difference, words, where),
    st.builds(Folded, words, words),
)
sections = st.lists(blocks, min_size=1, max_size=4).map(tuple)
verdicts = st.builds(
    Verdict,
    words,
    words,
    st.floats(0, 1e9),
    st.floats(0, 1e9),
    st.booleans(),
    words,
    st.tuples(words),
    st.none(),
)
reports = st.builds(
    Report,
    kind=words,
    title=words,
    answer=words,
    sentences=st.lists(words, max_size=3).map(tuple),
    verdicts=st.lists(verdicts, max_size=2).map(tuple),
    notes=st.lists(words, max_size=2).map(tuple),
    facts=st.lists(st.builds(Fact, words, words, st.booleans()), max_size=3).map(tuple),
    sections=st.lists(
        st.builds(lambda part, only: (part, only), sections, where), min_size=1, max_size=3
    ).map(
        lambda found: tuple(
            Section(f"s{i}", f"section {i}", part, only) for i, (part, only) in enumerate(found)
        )
    ),
)


def printed(report: Report, width: int = 80, *, terminal: bool = False) -> str:
    out = io.StringIO()
    show(report, Console(file=out, width=width, force_terminal=terminal, color_system=None))
    return out.getvalue()


def texts(value: Any, without: str) -> Iterator[str]:
    """Every sentence and cell of a tree, but for what stands in the other place alone."""
    if isinstance(value, dict):
        if value.get("only") != without:
            for key, part in value.items():
                if key not in ("only", "kind", "id", "wide"):
                    yield from texts(part, without)
    elif isinstance(value, list):
        for part in value:
            yield from texts(part, without)
    elif isinstance(value, str) and value:
        yield value


@settings(deadline=None, max_examples=40)
@given(reports)
def test_what_the_tree_says_the_page_says(report: Report) -> None:
    page = unescape(html(report))
    for text in texts(json.loads(json.dumps(tree(report))), without="console"):
        assert text in page


@settings(deadline=None, max_examples=40)
@given(reports)
def test_what_the_tree_says_the_console_says(report: Report) -> None:
    """But for notes, which are messages on stderr, titles of sections, other facts, and folded text."""
    plain = tree(report)
    kept = {key: plain[key] for key in ("title", "answer", "sentences", "verdicts")}
    kept["facts"] = [fact for fact in plain["facts"] if fact["brief"]]
    kept["blocks"] = [
        block
        for part in plain["sections"]
        if part["only"] != "page"
        for block in part["blocks"]
        if block["kind"] != "folded"
    ]
    said = printed(report)
    for text in texts(kept, without="page"):
        assert text in said


@settings(deadline=None, max_examples=40)
@given(words, words)
def test_what_stands_in_one_place_alone_is_not_in_the_other(here: str, there: str) -> None:
    report = Report(
        "k",
        "t",
        "a",
        sections=(Section("s", "s", (Text(f"1{here}1", "page"), Text(f"2{there}2", "console"))),),
    )
    assert f"1{here}1" in html(report)
    assert f"2{there}2" not in html(report)
    assert f"1{here}1" not in printed(report)
    assert f"2{there}2" in printed(report)


def test_a_picture_is_drawn_by_the_page_alone() -> None:
    drawn = []

    def draw() -> Any:
        from matplotlib.figure import Figure

        drawn.append(1)
        return Figure()

    report = Report("k", "t", "a", sections=(Section("s", "s", (Picture("p", "alt", "caption", draw),)),))
    assert "caption" not in printed(report)
    assert tree(report)["sections"][0]["blocks"] == [
        {"kind": "picture", "name": "p", "alt": "alt", "caption": "caption", "folded": ""}
    ]
    assert not drawn
    assert '<title id="p-title">alt</title>' in html(report)
    assert drawn


def shown(*blocks: Table, width: int) -> str:
    return printed(Report("k", "", "", sections=(Section("s", "s", blocks),)), width, terminal=True)


def test_a_narrow_terminal_leaves_the_wide_columns_out_and_a_wide_one_does_not() -> None:
    found = table("caption", "name | much | value", [("row", "m" * 60, "3")], wide=("much",))
    assert found is not None
    assert "mmm" not in shown(found, width=40)
    assert "value" in shown(found, width=40)
    assert "m" * 60 in shown(found, width=90)


def test_a_long_table_is_cut_on_a_terminal_and_says_so() -> None:
    found = table("caption", "name | value", [(f"row{i}", str(i)) for i in range(9)], most=3)
    assert found is not None
    text = shown(found, width=80)
    assert "(the first 3 of 9)" in text
    assert "row2" in text
    assert "row3" not in text
    assert "row8" in html(Report("k", "t", "a", sections=(Section("s", "s", (found,)),)))


@pytest.mark.parametrize(
    ("cells", "kind"),
    [
        (["1.5", "−3", "643\u202f200"], "number"),
        (["0.0035\u202fdeg/s", "29.5\u202f%", "–"], "number"),
        (["1·10⁻⁷", "<\u202f0.001", "-7.3e-05"], "number"),
        (["1.5", "no visit", "2", "3"], "number"),
        (["7: −60 to 60, even", "20"], "text"),
        (["0.1 … 0.2", "1 … 2"], "text"),
        (["2026-05-27", "2026-07-19"], "text"),
        (["–", ""], "text"),
        ([Bar(0.5), ""], "bar"),
    ],
)
def test_columns_are_aligned_by_what_stands_in_them(cells: list[Any], kind: str) -> None:
    found = table("caption", "name | value", [("row", cell) for cell in cells])
    assert found is not None
    assert found.kinds == ("text", kind)


def test_a_table_without_rows_is_none() -> None:
    assert table("caption", "name | value", []) is None


@pytest.mark.parametrize(
    ("reached", "after", "limit"),
    [(50.0, None, 100.0), (300.0, 20.0, 100.0), (0.0, 0.0, 0.0), (1e9, 1.0, 2.0)],
)
def test_a_gauge_keeps_its_limit_in_sight(reached: float, after: float | None, limit: float) -> None:
    verdict = Verdict("t", "d", reached, limit, reached <= limit, after=after)
    at, used, left = (float(verdict.width(x).rstrip("%")) for x in (limit, reached, after))
    assert 0.0 <= left <= max(used, left) <= 100.0
    assert (limit == 0.0) or at >= 4.5  # of the width: what is far off the scale ends at the edge
    assert (used <= at) == (reached <= limit)


def test_the_command_is_told_without_folders_and_what_changes_no_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = tmp_path / "a spec.yaml"
    spec.touch()
    given = ["/usr/bin/planner", "sweep", str(spec), "--vary", "a.b=1..2 deg/s", "-o", str(tmp_path)]
    given += ["--workers", "2", "--cluster=tcp://x", "--json", f"--history={spec}@2026-03-01", "--seed", "3"]
    monkeypatch.setattr(sys, "argv", given)
    assert invocation() == (
        "planner sweep 'a spec.yaml' --vary 'a.b=1..2 deg/s' '--history=a spec.yaml@2026-03-01' --seed 3"
    )
    assert not re.search("/", invocation().replace("deg/s", ""))
