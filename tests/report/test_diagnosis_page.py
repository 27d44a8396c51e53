"""diagnosis.json and the page: the interfaces' keys, read back as written, offline, the same bytes."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from planner.diagnose.diagnosis_to_residual import residual_changes, unit_fits
from planner.errors import InputError
from planner.export.diagnosis_json import diagnosis_document, diagnosis_text, read_diagnosis
from planner.nouns.diagnosed_spreads import Assumption, BudgetExceeded
from planner.nouns.diagnosis import (
    Diagnosis,
    NavigationCost,
    NextMeasurement,
    NotFound,
    Rival,
    UnitDiagnosis,
    Unknown,
    Untestable,
)
from planner.nouns.dwell_table import DwellTable
from planner.report.console import show
from planner.report.page import html
from planner.report.subjects.diagnosis import diagnosis_report
from planner.report.subjects.diagnosis_not_found import limits_table
from planner.spec.load import load_spec
from tests.calibrate.world import Hidden, Layout, campaign, sized
from tests.diagnose.found import found_effect, unit_diagnosis
from tests.specs import SHIPPED

SPEC = load_spec(SHIPPED / "small_uav.yaml").spec
LAYOUT = Layout(temperatures=(-40.0, 20.0, 60.0), rate_temperatures=(20.0,), later=(30.0,))
TABLE = campaign(1, [sized(Hidden("g_sensitivity", "gyro_y"), 40.0, 1, LAYOUT)], LAYOUT)


def complete() -> Diagnosis:
    """A diagnosis in which every part has something."""
    found = unit_diagnosis(TABLE, SPEC, [found_effect("g_sensitivity", "gyro_y", 1e-5, 1e-6)])
    effect = replace(found.effects[0], rivals=(Rival("g_squared_sensitivity", 1.5),))
    found = replace(
        found,
        verdict="partly_explained",
        effects=(effect,),
        unknown=(Unknown(("acc_x",), "time_on", 0.002, 12.0),),
        not_found=(NotFound("warm_up", "gyro", 1e-5, "deg/s", {"time_constant": 600.0}, ("z",)),),
        untestable=(Untestable("ageing", None, "every record is of one day"),),
        assumptions=(
            Assumption("gyro.bias", "run_to_run", "deg/s", 3e-5, 6e-5, 5e-5, 7e-5, 40.0),
            Assumption("gyro.bias", "in_run", "deg/s", 2e-5, math.nan, math.nan, math.nan, math.nan),
            Assumption("gyro.scale_factor", "run_to_run", "%", 1e-5, 3e-5, 2e-5, 9e-5, 3.0),
        ),
        budget_exceeded=(BudgetExceeded("gyro.bias", "run_to_run", 6e-5, 5e-5, 7e-5, 3e-5, "deg/s"),),
    )
    return Diagnosis(
        found=found,
        residual=residual_changes(unit_fits(TABLE, SPEC, found)),
        navigation=(NavigationCost("position", "m", 350.0, 4.0, 0.95, "flown", 300.0, 300.0),),
        next_measurement=(
            NextMeasurement(
                ("g_sensitivity", "g_squared_sensitivity"),
                "rate_table",
                "static",
                {"do": "the spec's test static", "temperature_degc": 20.0, "repeats": 2.0},
                9.0,
                3600.0,
            ),
        ),
        version="0.1.0",
        spec_name="a spec <b>with</b> & signs",
        spec_sha256="1" * 64,
        data_sha256="2" * 64,
        source="data.csv",
        seed=1,
        notes=("a note with <script>alert(1)</script>",),
    )


def _page(diagnosis: Diagnosis, table: DwellTable) -> str:
    return html(diagnosis_report(diagnosis, table))


@pytest.fixture(scope="module")
def diagnosis() -> Diagnosis:
    return complete()


@pytest.fixture(scope="module")
def page(diagnosis: Diagnosis) -> str:
    return _page(diagnosis, TABLE)


# ---------------------------------------------------------------- diagnosis.json


def test_it_has_the_keys_of_the_interfaces(diagnosis):
    d = diagnosis_document(diagnosis)
    assert d["verdict"] == "partly_explained"
    (effect,) = d["effects"]
    assert {"effect", "channels", "terms", "p_value", "rivals", "below_bench_uncertainty"} <= set(effect)
    assert {"name", "value", "unit", "ci95"} <= set(effect["terms"][0])
    assert effect["rivals"] == [{"effect": "g_squared_sensitivity", "separated_by": 1.5}]
    assert {"channels", "varies_with", "p_value"} <= set(d["unknown"][0])
    assert {"effect", "upper_limit95", "unit"} <= set(d["not_found"][0])
    assert {"effect", "why"} <= set(d["untestable"][0])
    assert set(d["residual"]) == {"gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"}
    change = d["residual"]["gyro_y"]
    assert {"unit", "before", "after", "within_run_before", "within_run_after", "noise_floor"} <= set(change)
    assert set(change["before"]) == {"rms", "ci95"}
    assert {"error", "unit", "before", "after"} <= set(d["navigation"])
    assert {"separates", "condition", "separation", "time_s"} <= set(d["next_measurement"][0])


def test_values_are_in_the_units_beside_them(diagnosis):
    d = diagnosis_document(diagnosis)
    term, si = d["effects"][0]["terms"][0], diagnosis.found.effects[0].terms[0].value
    assert term["unit"] == "deg/s/g"
    assert term["value"] == pytest.approx(math.degrees(si) * 9.80665)
    assert d["residual"]["acc_x"]["unit"] == "g"
    assert d["residual"]["acc_x"]["before"]["rms"] == pytest.approx(diagnosis.residual[3].before / 9.80665)
    assert d["not_found"][0]["upper_limit95"] == pytest.approx(math.degrees(1e-5))


def test_a_limit_says_at_which_parameters_and_of_which_terms_it_is(diagnosis):
    assert diagnosis_document(diagnosis)["not_found"][0]["terms"] == ["z"]
    (row,) = limits_table(diagnosis.found).rows
    assert "(time constant 600 s; z alone)" in row[2].replace("\u202f", " ").replace("\xa0", " ")


def test_it_is_json_without_nan_and_the_same_every_time(diagnosis):
    text = diagnosis_text(diagnosis)
    assert text == diagnosis_text(complete())
    assert json.loads(text, parse_constant=pytest.fail)["assumptions"][1]["measured"] is None


def test_it_reads_back_as_it_was_written(diagnosis, tmp_path):
    (tmp_path / "diagnosis.json").write_text(diagnosis_text(diagnosis), encoding="utf-8")
    for place in (tmp_path, tmp_path / "diagnosis.json"):
        assert diagnosis_text(read_diagnosis(place)) == diagnosis_text(
            replace(diagnosis, notes=(*diagnosis.notes, *diagnosis.found.notes))
        )


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "is empty"),
        ("[]", "missing"),
        ('{"verdict": "clean"}', "missing"),
        ("\x00\xff", "diagnosis"),
        (
            '{"verdict":"clean","effects":[{"effect":"nonsense"}],"residual":{},"spec":{},"unit":"u"}',
            "no diagnosis",
        ),
        ("[" * 100_000, "diagnosis"),
    ],
)
def test_what_is_no_diagnosis_is_refused(content, said, tmp_path):
    path = tmp_path / "d.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        read_diagnosis(path)


def test_an_altered_diagnosis_is_refused_where_it_makes_no_sense(diagnosis, tmp_path):
    for key, value in (("effect", "nonsense"), ("sensor", "accelerometer"), ("terms", [{"name": "x"}])):
        d = json.loads(diagnosis_text(diagnosis))
        d["effects"][0][key] = value
        (tmp_path / "d.json").write_text(json.dumps(d), encoding="utf-8")
        with pytest.raises(InputError, match="no diagnosis"):
            read_diagnosis(tmp_path / "d.json")


def test_a_folder_of_several_units_names_them(diagnosis, tmp_path):
    for unit in ("u1", "u2"):
        (tmp_path / unit).mkdir()
        (tmp_path / unit / "diagnosis.json").write_text(diagnosis_text(diagnosis), encoding="utf-8")
    with pytest.raises(InputError, match="u1, u2"):
        read_diagnosis(tmp_path)


# ---------------------------------------------------------------- the page


class Tags(HTMLParser):
    """Every start tag with its attributes; fails on tags that do not nest."""

    VOID = frozenset({"meta", "br", "link", "img", "hr", "input"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.found: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_whole_and_needs_nothing_from_outside(page):
    tags = Tags()
    tags.feed(page)
    assert not tags.open
    for _, attributes in tags.found:
        for name in ("src", "href", "xlink:href"):
            assert str(attributes.get(name) or "#").startswith("#")
    assert "<script" not in page
    assert not re.search(r"url\((?!#)", page)
    ids = [a["id"] for _, a in tags.found if a.get("id")]
    assert len(ids) == len(set(ids))


def test_the_page_is_the_same_every_time(page):
    assert _page(complete(), TABLE) == page


def test_what_people_wrote_is_escaped(page):
    assert "&lt;b&gt;with&lt;/b&gt; &amp; signs" in page
    assert "&lt;script&gt;" in page


def test_the_page_tells_all_of_it(page):
    for said in (
        "Missing: g-sensitivity, and something without a name",
        "time since power-on",
        "350",
        "Added-variable plot",
        "Residual of gyro_y against ",
        "Rivals that these data do not refuse",
        "the spec&#39;s test static",
        "contradicted",
        "above, as one of so many is by chance",
        "the data cannot tell",
        "no larger than",
        "every record is of one day",
    ):
        assert said in page, said


def test_a_clean_unit_has_a_page_of_its_own():
    clean = unit_diagnosis(TABLE, SPEC)
    page = _page(replace(complete(), found=clean, navigation=(), next_measurement=()), TABLE)
    assert "Nothing is missing" in page
    assert page.count("<svg") >= 2  # before and after, and what is left of the channels
    drawn = re.search(r'Residual of ([^"]*)', page)
    assert drawn is not None
    assert all(f"{c}_{a} against" in drawn[1] for c in ("gyro", "acc") for a in "xyz")


@pytest.mark.parametrize("verdict", ["untestable", "unexplained"])
def test_verdicts_without_an_effect_have_a_page(verdict):
    unknown = (Unknown(("gyro_x",), "day", 0.01, 9.0),) if verdict == "unexplained" else ()
    found = UnitDiagnosis("u1", verdict, (), unknown, (), (), (), ())
    bare = replace(complete(), found=found, residual=(), navigation=(), next_measurement=())
    page = _page(bare, TABLE)
    assert ("no name" if unknown else "cannot tell") in page
    assert diagnosis_document(bare)["navigation"]["before"] is None


def test_the_terminal_shows_verdict_coefficients_and_metres(diagnosis, capsys):
    from rich.console import Console

    show(diagnosis_report(diagnosis, TABLE), Console(highlight=False, soft_wrap=True))
    out = capsys.readouterr().out
    for said in (
        "u1\nMissing: g-sensitivity",
        "deg/s/g",
        "350",
        "g²-sensitivity",
        "untestable: ageing",
    ):
        assert said in out
    assert "\u202f" not in out


def test_a_file_name_is_shown_without_its_folder(diagnosis):
    page = _page(replace(diagnosis, source=str(Path("/secret/place/data.csv"))), TABLE)
    assert "/secret/place" not in page
