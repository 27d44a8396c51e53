"""The documentation as a site that opens offline: a page a file, nothing is loaded."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby

from planner import __version__
from planner.api.documentation.pages import Page


def site(pages: Sequence[Page]) -> dict[str, str]:
    """File -> content; the same pages give the same bytes."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("planner.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    template = environment.get_template("docs.html.j2")
    groups = [(group, list(members)) for group, members in groupby(pages, key=lambda page: page.group)]
    return {
        f"{page.name}.html": template.render(
            page=page, groups=groups, body=html_of(page.text), version=__version__
        )
        for page in pages
    }


def html_of(text: str) -> str:
    """Markdown as HTML: headings have anchors, tables scroll inside themselves."""
    from markdown_it import MarkdownIt

    made = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    made = re.sub(r"<h([23])>(.*?)</h\1>", _anchored, made)
    return made.replace("<table>", '<div class="scroll" tabindex="0"><table>').replace(
        "</table>", "</table></div>"
    )


def _anchored(heading: re.Match[str]) -> str:
    level, said = heading[1], heading[2]
    return f'<h{level} id="{anchor(re.sub("<.*?>", "", said))}">{said}</h{level}>'


def anchor(title: str) -> str:
    """A heading as an anchor: letters, digits, hyphens."""
    return re.sub(r"[^\w]+", "-", title.lower()).strip("-")
