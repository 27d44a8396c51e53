"""Smooth tables: what they say, how they are exported; when curves contradict the spec."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from planner.calibrate.curve_nodes import CurveNodes, Error, size_of
from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.calibrate.smooth_tables import MOST_NODES
from planner.campaign.design import design
from planner.export.calibration import calibration_document, read_tables
from planner.export.calibration_files import calibration_files
from planner.nouns.calibration import Calibration, SmoothTable
from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.dwell_table import DwellTable
from planner.pipelines.data import calibrate as calibrate_file
from planner.plan.schedule_to_steps import steps
from planner.simulate.campaign import Truth, prepared, simulate
from planner.spec.load import LoadedSpec, spec_from_bytes
from planner.temperature_table import hats
from tests.outcome import Run
from tests.specs import SHIPPED

GYRO_BIAS: Error = ("gyro", "bias")
DEGC = (-50.0, -30.0, -10.0, 10.0, 30.0, 50.0)


@cache
def unit_spec(estimator: str = "smooth", times: float = 1.0) -> LoadedSpec:
    """The helicopter's unit; times: how much larger its gyros' curves are."""
    tree: dict[str, Any] = yaml.safe_load((SHIPPED / "helicopter.yaml").read_text())
    tree["plan"]["temperature_estimator"] = estimator
    table = tree["unit"]["gyro"]["bias"]["temperature_residual"]
    for n, text in table.items():
        value, unit = text.split()
        table[n] = f"{times * float(value):.9g} {unit}"
    return spec_from_bytes(yaml.safe_dump(tree, allow_unicode=True).encode(), SHIPPED / "unit.yaml")


@cache
def measured(seed: int, family: str = "cubic", times: float = 1.0) -> tuple[DwellTable, Truth]:
    """Six temperatures, both tests twice at each."""
    spec = unit_spec("lines", times).spec
    visits = tuple(TestVisits(test, DEGC, (2,) * len(DEGC)) for test in ("static", "rates"))
    made = steps(spec, Campaign(visits, (), 0.0, 0.0, False))
    return simulate(design(made, spec), prepared(spec, family), seed)  # type: ignore[arg-type]  # a family's name


@cache
def found(seed: int, family: str = "cubic", times: float = 1.0, estimator: str = "smooth") -> Calibration:
    (one,) = calibrate(measured(seed, family, times)[0], unit_spec(estimator).spec)
    return one


def gyro_bias(one: Calibration) -> list[SmoothTable]:
    return [s for s in one.sensors[0].smooth if s.error == "gyro.bias"]


def remarks(one: Calibration) -> list[str]:
    return [note for sensor in one.sensors for note in sensor.notes if "contradict" in note]


# ---------------------------------------------------------------- what they say


def test_tables_are_exported_on_an_even_grid_over_the_range() -> None:
    one = found(1)
    for s in gyro_bias(one):
        np.testing.assert_allclose(s.temperature_degc, np.linspace(-55.0, 65.0, 25))
        assert np.all(s.low < s.value)
        assert np.all(s.value < s.high)
    tables = one.sensors[0].tables
    assert tables.reach == 0.0
    for i, s in enumerate(gyro_bias(one)):
        at = hats(s.temperature_degc, tables.temperature_degc, 0.0) @ tables.bias[i]
        np.testing.assert_allclose(at, s.value, rtol=1e-12)


def test_lines_between_their_nodes_do_not_undo_the_smoothing() -> None:
    """Visits 5 K apart: with a node at each and none between, the table said what straight lines say.

    What they miss falls as the square of the distance, to a sixteenth; less where the curve bends at a node.
    """
    tree: dict[str, Any] = yaml.safe_load((SHIPPED / "helicopter.yaml").read_text())
    tree["plan"] |= {"temperature_estimator": "smooth"}
    tree["plan"]["temperatures"]["range"] = ["-40 degC", "-20 degC"]
    spec = spec_from_bytes(yaml.safe_dump(tree, allow_unicode=True).encode(), SHIPPED / "unit.yaml").spec
    degc = (-40.0, -35.0, -30.0, -25.0, -20.0)
    visits = tuple(TestVisits(test, degc, (2,) * len(degc)) for test in ("static", "rates"))
    made = steps(spec, Campaign(visits, (), 0.0, 0.0, False))
    one, few = (
        calibrate(simulate(design(made, spec), prepared(spec, "cosines"), 3)[0], spec, options)[0]
        for options in (FitOptions(), FitOptions(nodes=5))
    )
    for fine, coarse in zip(gyro_bias(one), gyro_bias(few), strict=True):
        assert len(fine.temperature_degc) == 17
        assert np.abs(fine.missed).max() < 0.15 * np.abs(coarse.missed).max()


def test_they_differ_from_lines_between_the_nodes_and_hardly_at_them() -> None:
    smooth, lines = found(1), found(1, estimator="lines")
    assert not lines.sensors[0].smooth
    nodes = lines.sensors[0].tables.temperature_degc
    own = lines.sensors[0].tables.bias
    for i, s in enumerate(gyro_bias(smooth)):
        at_nodes = np.interp(nodes, s.temperature_degc, s.value) - own[i]
        between = s.value - np.interp(s.temperature_degc, nodes, own[i])
        assert np.abs(at_nodes).max() < 0.3 * np.abs(between).max()


def test_intervals_cover_the_curve_of_every_unit() -> None:
    """Four units of three channels, 25 nodes of which some six are independent: 95 ± 4 %."""
    inside, apart = [], []
    for seed in range(1, 5):
        one, truth = found(seed), measured(seed)[1]
        for s in gyro_bias(one):
            true = np.array([truth.at("gyro.bias", s.term, t) for t in s.temperature_degc])
            inside.append(np.mean((s.low <= true) & (true <= s.high)))
            apart.append((s.value - true) / s.standard_error)
    assert np.mean(inside) >= 0.85
    assert 0.5 < np.sqrt(np.mean(np.square(apart))) < 1.3


def test_the_size_of_the_curves_is_found() -> None:
    rng = np.random.default_rng(1)
    degc = np.linspace(-50.0, 50.0, 8)
    M = np.exp(-np.abs(np.subtract.outer(degc, degc)) / 60.0)
    C, freedom = 0.01 * np.eye(8), np.full(8, np.inf)
    for size in (0.04, 1.0, 25.0):
        covers = 0
        for _ in range(40):
            values = rng.multivariate_normal(np.full(8, 7.0), size * M + C, size=3)
            channels = [
                CurveNodes(("gyro", "bias"), i, "x", degc, v, C, freedom) for i, v in enumerate(values)
            ]
            one = size_of(channels, [M] * 3)
            covers += one.low <= size <= one.high
            assert min(1.0, one.most) <= one.value <= max(1.0, one.most)  # the table pulls towards itself
        assert covers >= 34  # of 40, 95 % each: 38 are expected, fewer than 34 come once in 90


def test_one_node_or_no_noise_says_nothing_strange() -> None:
    alone = CurveNodes(GYRO_BIAS, 0, "x", np.array([20.0]), np.array([1.0]), np.eye(1), np.ones(1))
    assert size_of([alone], [np.eye(1)]).value == pytest.approx(1.0)
    degc = np.array([0.0, 40.0])
    exact = CurveNodes(GYRO_BIAS, 0, "x", degc, np.array([1.0, 3.0]), np.zeros((2, 2)), np.ones(2))
    assert np.isfinite(size_of([exact], [np.eye(2)]).value)


# ---------------------------------------------------------------- files


def test_as_many_nodes_as_asked_for_and_what_lines_between_them_cost(tmp_path: Path) -> None:
    from planner.dwells.dwell_files import write_dwells

    data = tmp_path / "data.csv"
    write_dwells(measured(1)[0], data)
    costs = []
    for nodes in (4, 13):
        (one,) = calibrate_file(data, unit_spec(), FitOptions(nodes=nodes), lambda message: None)
        assert all(len(s.temperature_degc) == nodes for s in gyro_bias(one))
        (note,) = [n for n in one.notes if "m of horizontal" in n]
        assert f"between {nodes} nodes cost" in note
        costs.append(float(note.split("cost ")[1].split()[0]))
    assert costs[0] > 4.0 * costs[1] > 0.0  # lines miss with the square of the distance


def test_files_hold_the_tables_and_their_intervals(tmp_path: Path) -> None:
    one = found(1)
    document = json.loads(json.dumps(calibration_document(one)))["sensors"]["gyro"]
    (x, *_) = [s for s in document["smooth"] if s["error"] == "gyro.bias"]
    assert len(x["ci95"]) == len(x["value"]) == len(x["temperature_degc"]) <= MOST_NODES
    assert all(low < value < high for (low, high), value in zip(x["ci95"], x["value"], strict=True))
    assert x["size"]["ci95"][0] <= x["size"]["value"] <= x["size"]["ci95"][1]
    for path, content in calibration_files([one], tmp_path).items():
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    tables = read_tables(tmp_path)["gyro"]
    np.testing.assert_allclose(tables.bias, one.sensors[0].tables.bias, rtol=1e-12)
    header = (tmp_path / "calibration.h").read_text()
    assert f"#define PLANNER_GYRO_NODES {len(tables.temperature_degc)}" in header
    assert "if (t < node[0] - 0.0f)" in header
    assert "smooth" not in calibration_document(found(1, estimator="lines"))["sensors"]["gyro"]


def test_the_command_shows_them(tmp_path: Path, run: Run) -> None:
    from planner.dwells.dwell_files import write_dwells

    write_dwells(measured(1)[0], tmp_path / "data.csv")
    tree = yaml.safe_load((SHIPPED / "helicopter.yaml").read_text())
    tree["plan"]["temperature_estimator"] = "smooth"
    (tmp_path / "spec.yaml").write_text(yaml.safe_dump(tree))
    data, spec, out = (str(tmp_path / name) for name in ("data.csv", "spec.yaml", "out"))
    done = run("calibrate", data, "--spec", spec, "--nodes", "9", "-o", out)
    assert done.code == 0, done.err
    assert "gyro: smooth tables" in done.out
    assert "straight lines between 9 nodes cost" in done.out + done.err
    corrected = run("apply", out, data, "-o", str(tmp_path / "corrected.csv"))
    assert corrected.code == 0, corrected.err


# ---------------------------------------------------------------- when curves contradict the spec


@pytest.mark.parametrize("family", ["cosines", "kink"])
@pytest.mark.further("family", ["cubic", "matern"])
def test_curves_of_any_family_that_leaves_the_table_are_no_contradiction(family: str) -> None:
    """A remark comes in 1 % of the units at most; benchmarks/study_smooth.py has hundreds."""
    assert not remarks(found(2, family))


@pytest.mark.parametrize(("times", "remedy"), [(4.0, "plan again"), (0.2, "Fewer temperatures would do")])
def test_curves_of_another_size_are_told_whatever_the_estimator(times: float, remedy: str) -> None:
    for estimator in ("lines", "smooth"):
        (said,) = remarks(found(3, "kink", times, estimator))
        assert (
            "curves of gyro.bias over temperature contradict the families cosines, kink, cubic, matern"
            in said
        )
        assert remedy in said
        factor = float(said.split("they are ")[1].split(" times")[0])
        assert factor == pytest.approx(times, rel=0.6)


def test_a_node_that_stands_out_is_named() -> None:
    """One temperature at which a gyro is off, by less than curves are large."""
    table, _ = measured(4)
    assert table.gyro is not None
    gyro = table.gyro.copy()
    gyro[np.abs(table.temperature_degc - 10.0) < 2.0, 1] += np.radians(0.02)
    (one,) = calibrate(replace(table, gyro=gyro), unit_spec().spec)
    (said,) = remarks(one)
    assert "gyro.bias y" in said
    assert "10 degC" in said
    assert "planner diagnose" in said
