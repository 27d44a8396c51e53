"""The pages of the documentation, in their order: Markdown, written by hand or made from the program."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files

from planner.api.documentation import reference
from planner.errors import InputError
from planner.spec.places import did_you_mean

WRITTEN = (  # in the order in which they are read; a new page is named here
    ("", ("index", "tutorial")),
    (
        "How to",
        (
            "how_to/own_flight",
            "how_to/own_bench",
            "how_to/benches_and_shifts",
            "how_to/recordings",
            "how_to/loop",
            "how_to/cluster",
            "how_to/own_effect",
            "how_to/python",
        ),
    ),
)
EXPLAINED = (
    "Explanation",
    ("explanation/model", "explanation/promise", "explanation/comparison", "explanation/limits", "sources"),
)


@dataclass(frozen=True)
class Command:
    """A command as its help has it; options: (names, default, help)."""

    name: str
    help: str
    arguments: tuple[str, ...]
    options: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True)
class Page:
    """One page. name: its place, `how_to/own_flight`; group: its heading in the list; text: Markdown."""

    name: str
    group: str
    text: str

    @property
    def title(self) -> str:
        """Its first heading."""
        found = re.search(r"^# (.+)$", self.text, re.MULTILINE)
        return found[1] if found else self.name

    @property
    def up(self) -> str:
        """From the page to the folder of the site."""
        return "../" * self.name.count("/")


def pages(commands: Sequence[Command]) -> tuple[Page, ...]:
    """All pages. commands: what the command line offers."""
    made = {
        "reference/commands": reference.commands_page(commands),
        "reference/spec": reference.spec_page(),
        "reference/files": reference.files_page(),
        "reference/effects": reference.effects_page(),
        "reference/rules": reference.rules_page(),
        "reference/api": reference.api_page(),
    }
    found = [Page(name, group, text) for group, name, text in _written(WRITTEN)]
    found += [Page(name, "Reference", text) for name, text in made.items()]
    return (*found, *(Page(name, group, text) for group, name, text in _written([EXPLAINED])))


def _written(groups: Sequence[tuple[str, tuple[str, ...]]]) -> Iterator[tuple[str, str, str]]:
    folder = files("planner").joinpath("docs")
    for group, names in groups:
        for name in names:
            yield group, name, folder.joinpath(f"{name}.md").read_text(encoding="utf-8")


def page_named(name: str, found: Sequence[Page]) -> Page:
    """The page by its name or its last part. Raises InputError for one that there is not."""
    asked = name.removesuffix(".md").removesuffix(".html")
    for page in found:
        if asked in (page.name, page.name.rpartition("/")[2]):
            return page
    known = [page.name for page in found]
    raise InputError(f"there is no page {name!r}{did_you_mean(name, known)}; there are {', '.join(known)}")
