"""Pages in headless Chromium, where there is one: nothing overflows on a telephone, no error is told."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path

import pytest

from planner.export.json import plan_document
from planner.report.blocks import Bar, Fact, Items, Report, Table, Text, existing, section
from planner.report.comparison import compare
from planner.report.page import html
from planner.report.subjects.compare import comparison_report
from planner.report.subjects.plan import plan_report
from tests.report import sample

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NARROW, WIDE = 400, 1200
LONG = "a_name_without_any_place_to_break_it_" * 4
# asked of the page itself: what is wider than the window and not inside something that scrolls
PROBE = """<script>
addEventListener("error", e => (window.faults = window.faults || []).push(String(e.message)));
addEventListener("load", () => {
  const wide = document.documentElement.clientWidth, outside = [];
  for (const e of document.body.querySelectorAll("*")) {
    if (e.closest(".scroll, pre") && !e.matches(".scroll, pre")) continue;
    if (e.getBoundingClientRect().right > wide + 0.5) outside.push(e.outerHTML.slice(0, 80));
  }
  const letters = [...document.querySelectorAll("svg text")].filter(e => e.getBoundingClientRect().height > 0)
    .map(e => parseFloat(getComputedStyle(e).fontSize) * Math.hypot(e.getScreenCTM().a, e.getScreenCTM().b));
  document.body.setAttribute("data-told", JSON.stringify({
    outside, wide, scrolls: document.documentElement.scrollWidth, faults: window.faults || [],
    letters}));
});
</script>"""
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the path: pages are opened nowhere")


def stress() -> Report:
    """Every kind of block with words that cannot be broken and a table of many columns."""
    columns = tuple(f"column {i}" for i in range(30))
    row = (LONG, *(f"{i}.5" for i in range(28)), Bar(0.5))
    return Report(
        kind="Stress",
        title=LONG,
        answer=LONG,
        sentences=(LONG,),
        notes=(LONG,),
        facts=(Fact("SHA-256", "9f" * 32),),
        sections=existing(section("s", LONG, Text(LONG), Items((LONG,), LONG), Table(LONG, columns, (row,)))),
        command=f"planner plan {LONG}.yaml",
    )


def pages() -> dict[str, Report]:
    plan = sample.plan()
    return {
        "plan": plan_report(
            plan,
            allowed=sample.allowed(plan.allowances),
            sensitivities=sample.sensitivities(),
            constraints=sample.constraints(),
            spec_text=f"name: {LONG}\n",
            trajectory_name="small_uav_1",
        ),
        "comparison": comparison_report(
            compare([plan_document(plan), plan_document(sample.plan(repeats=5))])
        ),
        "stress": stress(),
    }


@pytest.mark.parametrize("width", [NARROW, WIDE])
@pytest.mark.parametrize("name", ["plan", "comparison", "stress"])
def test_nothing_overflows_and_letters_are_legible(name: str, width: int, tmp_path: Path) -> None:
    # headless Chromium makes no window narrower than 500 px, a frame may be
    page = html(pages()[name]).replace("</head>", f"{PROBE}</head>")
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    (tmp_path / "frame.html").write_text(
        f'<iframe src="page.html" style="width: {width}px; height: 900px; border: 0"></iframe>'
        '<script>addEventListener("load", () => document.body.setAttribute("data-told", '
        'document.querySelector("iframe").contentDocument.body.getAttribute("data-told")));</script>',
        encoding="utf-8",
    )
    options = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--allow-file-access-from-files",
    ]
    options += [
        "--enable-logging=stderr",
        f"--user-data-dir={tmp_path / 'profile'}",
        "--window-size=1400,1000",
    ]
    address = (tmp_path / "frame.html").as_uri()
    done = subprocess.run(
        [str(CHROMIUM), *options, "--dump-dom", address],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert "CONSOLE" not in done.stderr
    found = re.search(r'data-told="([^"]*)"', done.stdout)
    assert found is not None
    told = json.loads(unescape(found[1]))
    assert told["wide"] == width
    assert told["scrolls"] <= width
    assert told["outside"] == []
    assert told["faults"] == []
    assert told["letters"] or name != "plan"
    assert all(size >= 11.0 for size in told["letters"])  # px, at every width
