"""`planner docs`: every page there, every link alive, the reference made from the program itself."""

from __future__ import annotations

import re
from pathlib import Path
from posixpath import dirname, join, normpath

import jsonschema
import pytest
import typer

import planner
from planner.api.documentation.pages import Page, page_named, pages
from planner.api.documentation.site import html_of, site
from planner.cli import app
from planner.codes import rules
from planner.commands.docs import commands_of
from planner.export.schemas import FILES, schemas
from tests.outcome import Run
from tests.specs import ROOT


@pytest.fixture(scope="module")
def program():
    return typer.main.get_command(app)


@pytest.fixture(scope="module")
def found(program) -> tuple[Page, ...]:
    return pages(commands_of(program))


def text_of(found: tuple[Page, ...], name: str) -> str:
    return page_named(name, found).text


def dead_links(pages):
    """`page: link` of links that lead to no page of the site."""
    there = {f"{page.name}.html" for page in pages}
    return [
        f"{page.name}: {target}"
        for page in pages
        for target in re.findall(r"\]\(([^)#\s]+)", page.text)
        if "://" not in target and normpath(join(dirname(page.name), target)) not in there
    ]


def test_every_written_page_is_on_the_site_and_no_link_is_dead(found):
    written = {
        str(p.relative_to(ROOT / "planner" / "docs"))[:-3] for p in (ROOT / "planner/docs").rglob("*.md")
    }
    assert written <= {page.name for page in found}
    assert dead_links(found) == []
    assert all(page.title != page.name for page in found)


def test_the_reference_names_all_that_there_is(found, program):
    commands, api = text_of(found, "commands"), text_of(found, "api")
    assert all(f"## {name}\n" in commands for name in program.commands)
    assert all(f"## {name}\n" in api for name in ("plan", "load", "verify", "sweep", "report"))
    assert all(f"## {code}\n" in text_of(found, "rules") for code in rules())
    assert "`temperature_residual`" in text_of(found, "spec")
    assert "`ref_rate_x_dps`" in text_of(found, "files")
    assert "0x" not in api  # no addresses of functions
    assert {f.schema.rpartition("--of ")[2].strip("`") for f in FILES if "--of" in f.schema} <= set(schemas())


def test_the_site_is_whole_and_the_same_each_time(found):
    made = site(found)
    assert made == site(found)
    assert "index.html" in made
    for name, text in made.items():
        assert "<main>" in text
        assert "http" not in "".join(line for line in text.splitlines() if "src=" in line), name
        assert '<a href="' in text


def test_what_looks_like_html_in_a_page_is_text():
    assert "<script>" not in html_of("a <script>alert(1)</script> b")


def test_the_command_writes_a_site_and_prints_a_page(run: Run, tmp_path: Path) -> None:
    done = run("docs", "-o", "site", "--json")
    assert done.code == 0
    assert (tmp_path / "site" / "how_to" / "loop.html").exists()
    assert "tutorial" in done.json["pages"]
    assert run("docs", "limits").out.startswith("# What it cannot do")
    wrong = run("docs", "tutoral")
    assert wrong.code == 2
    assert "did you mean 'tutorial'" in wrong.err


@pytest.mark.parametrize("of", schemas())
def test_every_schema_is_one(of):
    schema = planner.schema(of)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"].endswith("2020-12/schema")
    assert schema["title"].startswith("planner ")
    assert schema["title"].endswith("schema version 1")
    assert schema["$id"] == f"urn:planner:{of}:1"


def test_a_file_that_lacks_a_key_is_refused_by_its_schema():
    whole = {"planner": "1", "spec": "s", "keys": [], "points": [], "wanted": 0}
    jsonschema.validate(whole, planner.schema("sweep"))
    with pytest.raises(jsonschema.ValidationError, match="wanted"):
        jsonschema.validate({k: v for k, v in whole.items() if k != "wanted"}, planner.schema("sweep"))
