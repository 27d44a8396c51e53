"""The page: well formed, self-contained, the same every time, honest about what is missing, small."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace

import pytest

from planner.nouns.allowances import AllowedErrors
from planner.nouns.plan import Plan
from planner.nouns.sensitivities import Constraint, Sensitivities
from planner.report.charts.gantt import campaign_picture
from planner.report.page import html
from planner.report.subjects.plan import plan_report
from tests.report import sample

XHTML = "{http://www.w3.org/1999/xhtml}"


def page(
    plan: Plan | None = None,
    *,
    allowed: AllowedErrors | None = None,
    sensitivities: Sensitivities | None = None,
    constraints: Sequence[Constraint] = (),
    spec_text: str = "planner: 1\n",
) -> str:
    return html(
        plan_report(
            plan or sample.plan(),
            allowed=allowed,
            sensitivities=sensitivities,
            constraints=constraints,
            spec_text=spec_text,
            trajectory_name="small_uav_1",
            service_life_s=500 * 3600.0,
        )
    )


def full_page() -> str:
    plan = sample.plan()
    return page(
        plan,
        allowed=sample.allowed(plan.allowances),
        sensitivities=sample.sensitivities(),
        constraints=sample.constraints(),
    )


@pytest.fixture(scope="module")
def full() -> str:
    return full_page()


def parsed(text: str) -> ET.Element:
    """As XML, which is stricter than any browser: every tag closed, every attribute quoted."""
    return ET.fromstring(text)


def words(text: str) -> str:
    return " ".join(" ".join(parsed(text).itertext()).split())


def test_is_well_formed_with_unique_anchors(full: str) -> None:
    ids = [e.get("id") for e in parsed(full).iter() if e.get("id")]
    assert len(ids) == len(set(ids))
    links = {e.get("href", "").removeprefix("#") for e in parsed(full).iter(f"{XHTML}a")}
    assert links <= set(ids)
    assert len(links) == 11


def test_internal_references_of_figures_resolve(full: str) -> None:
    ids = {e.get("id") for e in parsed(full).iter()}
    used = set(re.findall(r"url\(#([^)]+)\)", full)) | set(re.findall(r'xlink:href="#([^"]+)"', full))
    assert used
    assert used <= ids


def test_asks_nothing_of_the_network(full: str) -> None:
    loading = re.findall(r"""(?:src|href|data|action)\s*=\s*["'](?!#|data:image/png;base64,)[^"']*""", full)
    assert loading == []
    assert not re.search(r"@import|url\(\s*['\"]?(?!#)", full)
    assert "<script" not in full
    outside = re.sub(r'xmlns(:xlink)?="[^"]*"', "", full)
    assert "http" not in outside


def test_same_plan_gives_the_same_bytes(full: str) -> None:
    assert full_page() == full


def test_figures_are_named_for_those_who_cannot_see_them(full: str) -> None:
    figures = list(parsed(full).iter("{http://www.w3.org/2000/svg}svg"))
    assert len(figures) == 8
    for figure in figures:
        title = figure.find("{http://www.w3.org/2000/svg}title")
        assert title is not None
        assert title.get("id") == figure.get("aria-labelledby")
        assert len(title.text or "") > 30


def _luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.1."""
    values = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_letters_are_dark_on_white(full: str) -> None:
    """WCAG 2.1 asks for a contrast of 4.5 between letters and what is behind them."""
    colours = dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", full))
    behind = [_luminance(colours[name]) for name in ("surface", "page")]
    drawn = set(re.findall(r"<text [^>]*fill: (#[0-9a-f]{6})", full))
    assert drawn
    for letters in (*drawn, *(colours[name] for name in ("ink", "muted", "blue", "red"))):
        assert all((b + 0.05) / (_luminance(letters) + 0.05) >= 4.5 for b in behind), letters


@pytest.mark.parametrize(
    "evil", ['<script>alert("1")</script>', "</style><img src=x onerror=y>", "{{ 7*7 }} & 'q'"]
)
def test_text_of_the_spec_is_only_text(evil: str) -> None:
    text = page(replace(sample.plan(name=evil), notes=(evil,)), spec_text=evil)
    assert words(text).count(evil) == 4  # title, heading, note, spec
    assert "<script" not in text
    assert "<img" not in text


def test_headline_answers_first(full: str) -> None:
    said = words(full)
    assert "29.85 h" in said
    assert "1.24 days" in said
    assert "Proved: no campaign that meets the requirements does better" in said
    assert "position: 26.54 m ≤ 30 m margin 3.46 m, 11.5 %; at the end, worst case: met" in said
    assert "9f" * 32 in said


def test_a_gap_is_not_called_a_proof() -> None:
    said = words(page(replace(sample.plan(), gap=0.031, bound_s=100_000.0, proved=False)))
    assert "Proved:" not in said
    assert "within 3.10 % of the best possible" in said


def test_a_hand_made_plan_that_misses_its_limit_says_so() -> None:
    text = page(sample.fixed_plan(), constraints=sample.constraints(limit=20.0))
    said = words(text)
    assert "26.54 m > 20 m" in said
    assert "NOT met" in said
    assert "Hand-made plan" in said
    assert "Proved:" not in said
    assert "Convergence" not in said


def test_given_coefficients_are_shown_as_given() -> None:
    said = words(page(sensitivities=sample.given_sensitivities()))
    assert "Coefficients as the spec gives them" in said
    assert "Coefficients were given in the spec" in said
    assert "were simulated" not in said


@pytest.mark.parametrize(
    "plan",
    [
        sample.plan(),
        sample.fixed_plan(),
        replace(sample.plan(), genetic=None, reasons=(), notes=(), sensitivities=()),
        replace(sample.plan(), steps=(), tests=(), allowances=(), reasons=(), genetic=None, requirements=()),
        replace(sample.plan(), allowances=sample.plan().allowances[:1], reasons=(), genetic=None),
    ],
    ids=["plain", "fixed", "bare", "empty", "one_error"],
)
def test_what_is_missing_leaves_no_empty_box(plan: Plan) -> None:
    root = parsed(page(plan, spec_text=""))
    for tag in ("section", "figure", "table", "ul", "tbody", "p", "nav", "h2", "dd"):
        for element in root.iter(f"{XHTML}{tag}"):
            assert "".join(element.itertext()).strip(), tag
    links = len(list(root.iter(f"{XHTML}a")))
    assert links == len(list(root.iter(f"{XHTML}section")))


@pytest.mark.parametrize("rule", ["worst_case", "rss", "percentile"])
def test_every_rule_has_a_region(rule: str) -> None:
    plan = sample.plan(rule)
    said = words(page(plan, constraints=sample.constraints(rule)))
    assert "Allowed region of gyro.bias and accelerometer.bias" in said
    assert "There is none" not in said


def test_a_plan_of_100_000_steps_stays_small() -> None:
    text = page(sample.huge_plan())
    assert len(text.encode()) < 5_000_000
    assert "100000 steps" in text


def test_settings_of_the_user_neither_matter_nor_change() -> None:
    import matplotlib as mpl

    plan = sample.plan()
    usual = campaign_picture(plan).svg
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "svg.hashsalt": "other"}):
        assert campaign_picture(plan).svg == usual
        assert mpl.rcParams["lines.linewidth"] == 9.0
