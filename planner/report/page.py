"""A report as one page that opens offline: nothing is loaded, the same report gives the same bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import __version__
from planner.report.blocks import Report
from planner.report.numbers import short_names

if TYPE_CHECKING:
    from jinja2 import Environment


def html(report: Report) -> str:
    """The page; its footer names the command and the version that made it."""
    sections = [part for part in report.sections if part.only != "console"]
    page = _templates().get_template("page.html.j2")
    return short_names(page.render(report=report, sections=sections, version=__version__))


def first_screen(report: Report) -> str:
    """What a notebook shows: the answer, its reasons, the verdicts, and the tables of the first section."""
    return _templates().get_template("screen.html.j2").render(report=report)


def _templates() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("planner.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
