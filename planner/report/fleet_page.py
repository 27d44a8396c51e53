"""The page that the reports of accept, forecast and recalibrate share: headline, facts, sections."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from planner import __version__
from planner.report.blocks import Section
from planner.report.html import Fact
from planner.report.page_template import page_template


@dataclass(frozen=True)
class Page:
    """What stands on the page; kind: what it is and of what; sentence: the answer's reason."""

    title: str
    kind: str
    headline: str
    sentence: str
    notes: tuple[str, ...]
    facts: tuple[Fact, ...]
    sections: Sequence[Section | None]


def page_html(page: Page) -> str:
    """The page as text: the same page gives the same bytes."""
    return page_template("fleet.html.j2").render(
        title=page.title,
        kind=page.kind,
        headline=page.headline,
        sentence=page.sentence,
        notes=page.notes,
        facts=[*page.facts, Fact("planner", __version__)],
        sections=[s for s in page.sections if s is not None],
    )


def counted(number: int, one: str, many: str | None = None) -> str:
    """`1 unit`, `3 units`."""
    return f"{number} {one if number == 1 else many or f'{one}s'}"
