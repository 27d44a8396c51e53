"""Every kind of page in headless Chromium, where there is one, all in one process: on telephone and paper
nothing overflows, letters can be read, nothing of a chart is cut, each says what it shows; no error is told.
"""

from __future__ import annotations

import io
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from html import unescape
from pathlib import Path
from typing import Any

import pytest
import yaml

from planner.cli import main
from planner.report.blocks import Bar, Fact, Items, Report, Table, Text, existing, section
from planner.report.page import html
from planner.report.subjects.plan import plan_report
from tests.fleet.test_commands import history, table
from tests.report import sample
from tests.specs import SHIPPED, small, with_limit, with_plan

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NARROW, WIDE = 400, 1200
PAPER = 688  # px: A4 without its margins, 182 mm; letter is wider
LONG = "a_name_without_any_place_to_break_it_" * 4
# asked of the page itself: what is wider than the window and not inside something that scrolls
PROBE = """<script>
addEventListener("error", e => (window.faults = window.faults || []).push(String(e.message)));
addEventListener("load", () => {
  const wide = document.documentElement.clientWidth, outside = [];
  for (const e of document.body.querySelectorAll("*")) {
    if (wide !== %d && e.closest(".scroll, pre") && !e.matches(".scroll, pre")) continue;
    if (e.getBoundingClientRect().right > wide + 0.5) outside.push(e.outerHTML.slice(0, 80));
  }
  const letters = [...document.querySelectorAll("svg text")].filter(e => e.getBoundingClientRect().height > 0)
    .map(e => parseFloat(getComputedStyle(e).fontSize) * Math.hypot(e.getScreenCTM().a, e.getScreenCTM().b));
  const charts = [...document.querySelectorAll("svg")];
  const cut = charts.flatMap(s => { const b = s.getBoundingClientRect();
    return [...s.querySelectorAll("text")].filter(t => { const r = t.getBoundingClientRect();
      return r.height > 0 && (r.right > b.right + 1 || r.left < b.left - 1 || r.bottom > b.bottom + 1); })
    .map(t => t.textContent); });
  const silent = charts.filter(s => !(s.getAttribute("aria-label") || s.querySelector("title"))).length;
  const footer = document.querySelector("footer, .small");
  document.body.setAttribute("data-told", JSON.stringify({
    outside, wide, scrolls: document.documentElement.scrollWidth, faults: window.faults || [], letters, cut,
    silent, charts: charts.length, title: document.title, footer: footer ? footer.textContent : ""}));
});
</script>""".replace("%d", str(PAPER))  # paper does not scroll
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


def made_here() -> dict[str, str]:
    """Pages of records that were made for tests, and one of words that cannot be broken."""
    plan = sample.plan()
    of_plan = plan_report(
        plan,
        allowed=sample.allowed(plan.allowances),
        sensitivities=sample.sensitivities(),
        constraints=sample.constraints(),
        spec_text=f"name: {LONG}\n",
        trajectory_name="small_uav_1",
    )
    return {"sample": html(of_plan), "stress": html(stress())}


def made_by_commands(folder: Path, call: Callable[..., tuple[int, str]]) -> dict[str, str]:
    """A page of every command that writes one, of the smallest spec and tables there are."""
    spec = with_limit(small(recalibration={"rest": "1 min", "repeats": 6}), "9.2 m")
    shifts = {"from": "08:00", "to": "17:00", "start": "2026-12-21 08:00", "holidays": ["DE"]}
    batch = with_plan(spec, units=4, shifts=shifts)
    batch["benches"]["rate_table"]["units"] = 2
    for name, tree in (("spec", spec), ("batch", batch)):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(tree, sort_keys=False))
    rows = (f"{t / 50},0.01,{0.02 * (t % 7)},0,0,0,{1 + 0.001 * (t % 5)}" for t in range(600))
    columns = "time_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g"
    (folder / "raw.csv").write_text("\n".join([columns, *rows]) + "\n")
    for command in (
        ("plan", "spec.yaml", "-o", "plan"),
        ("plan", "batch.yaml", "-o", "batch"),
        ("compare", "plan", "batch", "-o", "compare"),
        ("verify", "spec.yaml", "plan", "--flights", "40", "-o", "verify"),
        ("sweep", "spec.yaml", "--vary", "requirement.0.limit=9.2,10,15,20m", "-o", "sweep"),
        ("accept", table(folder), "--spec", "spec.yaml", "-o", "accept"),
        ("forecast", history(folder), "--spec", "spec.yaml", "-o", "forecast"),
        ("recalibrate", "spec.yaml", "--start", "2026-12-01", "-o", "recalibrate"),
        ("simulate", "spec.yaml", "--seed", "3", "-o", "data.csv"),
        ("diagnose", "data.csv", "--spec", "spec.yaml", "-o", "diagnose"),
        ("sensitivity", SHIPPED / "small_uav.yaml", "-o", "sensitivity"),
        ("look", "raw.csv", "-o", "look"),
        ("export", "batch", "--format", "ics", "-o", "operator"),
        ("docs", "-o", "docs"),
    ):
        code, said = call(*command)
        assert code in (0, 4), (command, said)
    return {
        str(file.relative_to(folder)): file.read_text(encoding="utf-8")
        for file in sorted(folder.rglob("*.html"))
    }


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, int], dict[str, Any]]:
    """(page, width) -> what the page says of itself, all of one Chromium."""
    folder, shown = tmp_path_factory.mktemp("pages"), tmp_path_factory.mktemp("shown")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)

        def call(*arguments: object) -> tuple[int, str]:
            patch.setattr(sys, "argv", ["planner", *map(str, arguments)])
            said = io.StringIO()
            with redirect_stdout(said), redirect_stderr(said), pytest.raises(SystemExit) as end:
                main()
            return int(end.value.code or 0), said.getvalue()

        pages = {**made_here(), **made_by_commands(folder, call)}
    frames = []
    for number, (name, page) in enumerate(pages.items()):
        probed = page.replace("</head>", f"{PROBE}</head>", 1)
        printed = probed.replace("@media print {", "@media all {").replace(
            "@media screen {", "@media not all {"
        )
        for width, text in ((NARROW, probed), (WIDE, probed), (PAPER, printed)):
            (shown / f"{number}_{width}.html").write_text(text, encoding="utf-8")
            frames.append(
                f'<iframe name="{name}|{width}" src="{number}_{width}.html" '
                f'style="width: {width}px; height: 900px; border: 0"></iframe>'
            )
    return opened("".join(frames), shown)


def opened(frames: str, shown: Path) -> dict[tuple[str, int], dict[str, Any]]:
    """What the pages in frames say; headless Chromium makes no window narrower than 500 px, frames may be."""
    (shown / "frames.html").write_text(
        frames + '<script>addEventListener("load", () => document.body.setAttribute("data-all", '
        'JSON.stringify([...document.querySelectorAll("iframe")].map(f => [f.name, '
        'f.contentDocument.body.getAttribute("data-told")]))));</script>',
        encoding="utf-8",
    )
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--enable-logging=stderr"]
    options += ["--allow-file-access-from-files", f"--user-data-dir={shown / 'profile'}"]
    options += ["--window-size=1400,1000", "--dump-dom", (shown / "frames.html").as_uri()]
    done = subprocess.run([str(CHROMIUM), *options], capture_output=True, text=True, timeout=180, check=True)
    assert "CONSOLE" not in done.stderr
    found = re.search(r'data-all="([^"]*)"', done.stdout)
    assert found is not None
    told = {}
    for key, each in json.loads(unescape(found[1])):
        name, _, width = key.partition("|")
        told[name, int(width)] = json.loads(each)
    return told


Told = dict[tuple[str, int], dict[str, Any]]


def test_every_kind_of_page_is_whole_on_telephone_and_paper(told: Told) -> None:
    """One test of four questions: workers of a test run would make the pages once each, half a minute."""
    every_kind_is_opened(told)
    for (name, width), page in told.items():
        nothing_overflows(name, width, page)
        charts_can_be_read(name, width, page)
        it_says_what_it_is_and_what_made_it(name, width, page)


def every_kind_is_opened(told: Told) -> None:
    of_commands = {name.partition("/")[0] for name, _ in told} - {"sample", "stress"}
    assert of_commands == {
        *("plan", "batch", "compare", "verify", "sweep", "accept", "forecast", "recalibrate", "diagnose"),
        *("sensitivity", "look", "operator", "docs"),
    }
    with_charts = {name for (name, _), page in told.items() if page["charts"]}
    assert len(with_charts) >= 11
    assert all(told[name, NARROW]["letters"] for name in with_charts)


def nothing_overflows(name: str, width: int, page: dict[str, Any]) -> None:
    if (name, width) == ("stress", PAPER):
        return  # 30 columns fit no paper
    assert page["wide"] == width, name
    assert page["scrolls"] <= width, (name, width)
    assert page["outside"] == [], (name, width)
    assert page["faults"] == [], (name, width)


def charts_can_be_read(name: str, width: int, page: dict[str, Any]) -> None:
    least = 8.0 if width == PAPER else 11.0  # px; on paper 8 px are 6 pt
    assert all(size >= least for size in page["letters"]), (name, width)
    assert page["cut"] == [], (name, width)
    assert page["silent"] == 0, name  # an alternative text of every chart


def it_says_what_it_is_and_what_made_it(name: str, width: int, page: dict[str, Any]) -> None:
    assert page["title"].strip(), (name, width)
    if name.endswith("report.html"):
        command = name.partition("/")[0].replace("batch", "plan")
        assert f"planner {command} " in page["footer"], name
