"""A report as one page that opens offline: nothing is loaded, the same report gives the same bytes."""

from __future__ import annotations

from planner import __version__
from planner.report.blocks import Report


def html(report: Report) -> str:
    """The page; its footer names the command and the version that made it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("planner.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    sections = [part for part in report.sections if part.only != "console"]
    return environment.get_template("page.html.j2").render(
        report=report, sections=sections, version=__version__
    )
