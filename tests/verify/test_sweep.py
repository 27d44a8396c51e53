"""Sweeps: what --vary means, the grid, points that cannot be met, resuming, and the files."""

from __future__ import annotations

import csv
import json

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import planner.commands.sweeping as sweeping
from planner.cli import app
from planner.errors import InputError
from planner.pipelines.planning import plan as plan_fully
from planner.pipelines.sweep import points_of, sweep
from planner.spec.load import load_spec
from planner.verify.vary import Variation, grid, variation
from tests.specs import small


@pytest.fixture(name="spec")
def _spec(tmp_path):
    file = tmp_path / "spec.yaml"
    file.write_bytes(yaml.safe_dump(small(), sort_keys=False).encode())
    return file


def run(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.mark.parametrize(
    ("text", "points", "values"),
    [
        ("requirement.0.limit=5..50m", 4, ("5 m", "20 m", "35 m", "50 m")),
        ("requirement.0.limit=5 m..6 m", 2, ("5 m", "6 m")),
        ("plan.confidence=90,95,99%", 9, ("90 %", "95 %", "99 %")),
        ("plan.confidence=90%,0.95", 9, ("90 %", 0.95)),
        ("plan.repeats.most=10..12", 3, (10, 11, 12)),
        ("plan.quantile=normal,student", 9, ("normal", "student")),
        ("unit.gyro.bias.run_to_run=1e-3..2e-3 deg/s", 2, ("0.001 deg/s", "0.002 deg/s")),
        ("plan.temperatures.room=-10..10 degC", 3, ("-10 degC", "0 degC", "10 degC")),
    ],
)
def test_what_vary_means(text, points, values):
    found = variation(text, points)
    assert found.key == text.split("=")[0]
    assert found.values == values


@pytest.mark.parametrize("text", ["", "a", "a=", "=5", "a=5..b", "a=5m..6s", "a=1,,2", "a=x..y"])
def test_what_vary_does_not_mean(text):
    with pytest.raises(InputError, match="--vary"):
        variation(text, 3)


@settings(deadline=None, max_examples=30)
@given(st.text(max_size=20))
def test_any_text_is_a_variation_or_is_refused(text):
    try:
        found = variation(text, 3)
    except InputError:
        return
    assert found.key
    assert found.values


@pytest.mark.parametrize(
    "key", ["requirement.1.limit", "requirement.x.limit", "unit.giro.bias", "plan.confidence.x.y", "name.x"]
)
def test_a_key_that_leads_nowhere_is_refused(key):
    with pytest.raises(InputError, match="spec"):
        grid(small(), [Variation(key, (1, 2))], "1")


def test_the_grid_is_every_combination_the_last_key_fastest():
    varied = [
        Variation("requirement.0.limit", ("8 m", "9 m")),
        Variation("plan.confidence", ("90 %", "95 %")),
    ]
    found = grid(small(), varied, "1")
    assert [tuple(p.values.values()) for p in found] == [
        ("8 m", "90 %"),
        ("8 m", "95 %"),
        ("9 m", "90 %"),
        ("9 m", "95 %"),
    ]
    assert len({p.digest for p in found}) == 4
    assert yaml.safe_load(found[1].text)["plan"]["confidence"] == "95 %"
    assert grid(small(), varied, "2")[0].digest != found[0].digest


def test_a_grid_that_never_ends_is_refused():
    with pytest.raises(InputError, match="too many"):
        grid(small(), [Variation(k, tuple(range(1000))) for k in ("name", "trajectory")], "1")


def test_every_point_is_what_plan_says_of_it(spec, tmp_path):
    """The sweep leaves the genetic algorithm out; the exact campaign is the same."""
    points = points_of(spec, ["requirement.0.limit=9,12m"], 3)
    for point, found in sweep(spec, points, 1, None, lambda message: None):
        file = tmp_path / "one.yaml"
        file.write_text(point.text)
        wanted = plan_fully(load_spec(file), lambda message: None).plan
        assert found["time_s"] == pytest.approx(wanted.time_s, rel=1e-12)
        assert found["proved"] == wanted.proved
        assert [t["repeats"] for t in found["tests"]] == [list(t.repeats) for t in wanted.tests]


def test_a_looser_limit_never_takes_longer_and_more_confidence_never_less(spec, tmp_path):
    out = tmp_path / "out"
    result = run(
        "sweep",
        spec,
        "--vary",
        "requirement.0.limit=8.5..14m",
        "--vary",
        "plan.confidence=90,99%",
        "--points",
        4,
        "-o",
        out,
        "--json",
    )
    assert result.exit_code == 0, result.output
    points = json.loads(result.stdout)["points"]
    for confidence in ("90 %", "99 %"):
        times = [p["time_s"] for p in points if p["values"]["plan.confidence"] == confidence]
        assert times == sorted(times, reverse=True)
    pairs = zip(points[::2], points[1::2], strict=True)
    assert all(low["time_s"] <= high["time_s"] for low, high in pairs)
    with (out / "sweep.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(r["hours"]) for r in rows] == pytest.approx([p["time_s"] / 3600 for p in points], abs=1e-6)
    assert "svg" in (out / "report.html").read_text()


def test_points_that_cannot_be_met_or_read_are_marked_and_the_rest_is_planned(spec, tmp_path):
    out = tmp_path / "out"
    result = run("sweep", spec, "--vary", "requirement.0.limit=1 m,10 m,3 s", "-o", out, "--json")
    assert result.exit_code == 0, result.output
    points = json.loads(result.stdout)["points"]
    assert [p["status"] for p in points] == ["infeasible", "planned", "invalid"]
    assert points[0]["nearest_limit"] > 1.0
    assert points[0]["binds"]


def test_a_sweep_without_any_spec_is_refused(spec, tmp_path):
    result = run("sweep", spec, "--vary", "requirement.0.limit=1,2 s", "-o", tmp_path / "out")
    assert result.exit_code != 0
    assert "requirement[0].limit" in str(result.exception)


def test_a_stopped_sweep_goes_on_where_it_was(spec, tmp_path, monkeypatch):
    import planner.pipelines.sweep as pipeline

    out = tmp_path / "out"
    arguments = ("sweep", spec, "--vary", "requirement.0.limit=9..12m", "--points", 4, "-o", out, "--json")
    whole, planned = pipeline.sweep, []

    def stops(*args):
        for i, found in enumerate(whole(*args)):
            if i == 2:
                raise KeyboardInterrupt
            yield found

    def counts(*args):
        for found in whole(*args):
            planned.append(found)
            yield found

    monkeypatch.setattr(pipeline, "sweep", stops)
    result = run(*arguments)
    assert result.exit_code == 4
    assert len(json.loads(result.stdout)["points"]) == 2
    broken = next((out / "points").iterdir())
    broken.write_text("{")  # as a crash of the disk would leave it: planned again
    monkeypatch.setattr(pipeline, "sweep", counts)
    result = run(*arguments)
    assert result.exit_code == 0
    assert len(planned) == 3
    assert len(json.loads(result.stdout)["points"]) == 4


def test_workers_find_the_same(spec, tmp_path):
    vary = ("--vary", "requirement.0.limit=9..12m", "--points", 3, "--json")
    one, two = (run("sweep", spec, *vary, "-o", tmp_path / str(n), "--workers", n) for n in (1, 2))
    assert one.exit_code == two.exit_code == 0
    assert one.stdout == two.stdout
    assert (tmp_path / "1" / "report.html").read_bytes() == (tmp_path / "2" / "report.html").read_bytes()


def test_a_wrong_spec_is_refused_with_its_place(tmp_path):
    file = tmp_path / "spec.yaml"
    file.write_text("planner: 1\nname: 5\n")
    result = run("sweep", file, "--vary", "name=1,2", "-o", tmp_path / "out")
    assert result.exit_code != 0
    assert not (tmp_path / "out").exists()


def test_kept_points_are_of_their_own_spec(spec, tmp_path):
    (point,) = points_of(spec, ["requirement.0.limit=9m"], 1)
    file = sweeping._file(tmp_path, point)
    file.parent.mkdir()
    file.write_text(json.dumps({"digest": "another"}))
    assert sweeping._kept(tmp_path, point) is None
