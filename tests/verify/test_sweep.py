"""Sweeps: what --vary means, the grid, points that cannot be met, resuming, and the files."""

from __future__ import annotations

import csv
import itertools
import json
from concurrent.futures.process import BrokenProcessPool

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import planner.api.sweeping as sweeping
import planner.verify.workers as workers
from planner.errors import InputError, StoppedEarly
from planner.pipelines.planning import plan as plan_fully
from planner.pipelines.sweep import points_of, sweep
from planner.spec.load import load_spec
from planner.spec.yaml12 import read_yaml
from planner.verify.vary import Variation, grid, variation
from tests.specs import small


@pytest.fixture(name="spec")
def _spec(tmp_path):
    file = tmp_path / "spec.yaml"
    file.write_bytes(yaml.safe_dump(small(), sort_keys=False).encode())
    return file


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
        ("plan.repeats.most=20..8", 3, (20, 14, 8)),
        ("requirement.0.limit=8..8m", 3, ("8 m",)),
    ],
)
def test_what_vary_means(text, points, values):
    found = variation(text, points)
    assert found.key == text.split("=")[0]
    assert found.values == values


@pytest.mark.parametrize(
    "text", ["", "a", "a=", "=5", "a=5..b", "a=5m..6s", "a=1,,2", "a=x..y", "a=1e308..-1e308"]
)
def test_what_vary_does_not_mean(text):
    with pytest.raises(InputError, match="--vary"):
        variation(text, 3)


@pytest.mark.parametrize(
    ("said", "own", "values"),
    [
        ("180,200,300m", "150 m", ("180 m", "200 m", "300 m")),
        ("180 m,200 m,0.3km", "150 m", ("180 m", "200 m", "0.3 km")),
        ("1,2,3km", None, ("1 km", "2 km", "3 km")),
    ],
)
def test_bare_numbers_take_the_unit_that_the_list_and_the_spec_have(said, own, values):
    tree = {"requirement": [{"limit": own} if own else {}]}
    assert variation(f"requirement.0.limit={said}", 3, tree).values == values


@pytest.mark.parametrize("said", ["180,200,0.3km", "0.3km,180,200", "180 km,200,300 m"])
def test_bare_numbers_that_could_have_either_unit_are_refused_with_the_readings(said):
    with pytest.raises(InputError, match=r"could be .*200 km.* or .*200 m|could be .*200 m.* or .*200 km"):
        variation(f"requirement.0.limit={said}", 3, {"requirement": [{"limit": "150 m"}]})


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


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("requirement.7.limit", "a list in the spec; its items are requirement.0"),
        ("requirement.00.limit", "a list in the spec"),
        ("unit.gyro.bais.run_to_run", "no 'unit.gyro.bais'; did you mean 'bias'"),
        ("plan.confidence.x", "plan.confidence is a single value"),
        (".", "no ''"),
    ],
)
def test_a_refused_key_says_what_stands_there(key, says):
    with pytest.raises(InputError) as refused:
        grid(small(), [Variation(key, (1, 2))], "1")
    assert key in str(refused.value)
    assert says in str(refused.value)


def test_a_key_may_have_points_in_its_name():
    found = grid(small(), [Variation("sensitivities.given.gyro.bias", ("500 m/(deg/s)",))], "1")
    assert yaml.safe_load(found[0].text)["sensitivities"]["given"]["gyro.bias"] == "500 m/(deg/s)"


TEXTS = st.one_of(
    st.sampled_from(["1e5", "no", "12:30", "2026-03-01", "0o17", "~", "'"]), st.text(max_size=9)
)


@settings(deadline=None, max_examples=60)
@given(st.dictionaries(st.sampled_from("abc"), st.one_of(TEXTS, st.integers(), st.booleans()), min_size=1))
def test_a_point_reads_back_as_what_it_was_made_of(tree):
    """PyYAML writes YAML 1.1, in which 1e5 is a text; specs are read as YAML 1.2, in which it is a number."""
    printable = {k: v for k, v in tree.items() if not isinstance(v, str) or v.isprintable()}
    text = grid({"z": 1, **printable}, [Variation("z", ("1e5",))], "1")[0].text
    assert read_yaml(text.encode(), "point").value == {"z": "1e5", **printable}


@given(st.lists(st.integers(1, 5), min_size=1, max_size=4))
def test_a_point_knows_its_values_and_every_value_its_points(sizes):
    varied = [Variation(f"k{i}", tuple(range(n))) for i, n in enumerate(sizes)]
    found = grid({}, varied, "1")
    wanted = [dict(zip(found.keys, values, strict=True)) for values in itertools.product(*map(range, sizes))]
    assert [dict(p.values) for p in found] == wanted
    for i, v in enumerate(varied):
        for k, value in enumerate(v.values):
            assert list(found.having(i, k)) == [n for n, w in enumerate(wanted) if w[v.key] == value]


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
    points = points_of(load_spec(spec), ["requirement.0.limit=9,12m"], 3)
    for number, found in sweep(spec, points, range(len(points)), 1, None):
        file = tmp_path / "one.yaml"
        file.write_text(points[number].text)
        wanted = plan_fully(load_spec(file), lambda message: None).plan
        assert found["time_s"] == pytest.approx(wanted.time_s, rel=1e-12)
        assert found["proved"] == wanted.proved
        assert [t["repeats"] for t in found["tests"]] == [list(t.repeats) for t in wanted.tests]


def test_a_looser_limit_never_takes_longer_and_more_confidence_never_less(run, spec, tmp_path):
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
    assert result.code == 0, result.err
    points = result.json["points"]
    for confidence in ("90 %", "99 %"):
        times = [p["time_s"] for p in points if p["values"]["plan.confidence"] == confidence]
        assert times == sorted(times, reverse=True)
    pairs = zip(points[::2], points[1::2], strict=True)
    assert all(low["time_s"] <= high["time_s"] for low, high in pairs)
    with (out / "sweep.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [float(r["time_s"]) for r in rows] == [p["time_s"] for p in points]
    asked = {f"{r['requirement.0.limit']} {r['requirement.0.limit unit']}" for r in rows}
    assert asked == {p["values"]["requirement.0.limit"] for p in points}
    assert {r["achieved_0_unit"] for r in rows} == {"m"}
    assert all(float(r["achieved_0"]) <= float(r["limit_0"]) for r in rows)
    assert "svg" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    "vary", ["requirement.0.limit=9 m,3 s", "plan.confidence=90..200%", "plan.quantile=normal,foo"]
)
def test_a_value_that_no_point_can_have_is_refused_before_anything_is_planned(run, spec, tmp_path, vary):
    result = run("sweep", spec, "--vary", vary, "--points", 3, "--vary", "plan.seed=1,2", "-o", "out")
    assert result.code == 2
    assert f"--vary {vary.partition('=')[0]}=" in result.err
    assert "spec.yaml:" not in result.err  # the lines of a point's spec are those of no file
    assert not (tmp_path / "out").exists()


def test_points_that_cannot_be_met_or_read_are_marked_and_the_rest_is_planned(run, spec, tmp_path):
    """A fifth repeat is refused only beside at most four: each value alone is fine somewhere."""
    vary = ("requirement.0.limit=1 m,10 m", "plan.repeats.least=2,5", "plan.repeats.most=4,40")
    arguments = [word for text in vary for word in ("--vary", text)]
    result = run("sweep", spec, *arguments, "-o", tmp_path / "out", "--json")
    assert result.code == 0, result.err
    points = result.json["points"]
    told = {tuple(p["values"].values()): p for p in points}
    assert told["10 m", 2, 40]["status"] == told["10 m", 5, 40]["status"] == "planned"
    assert told["10 m", 2, 40]["time_s"] <= told["10 m", 5, 40]["time_s"]
    assert {p["status"] for (limit, *_), p in told.items() if limit == "1 m"} == {"infeasible", "invalid"}
    assert told["1 m", 2, 40]["nearest_limit"] > 1.0
    assert told["1 m", 2, 40]["binds"]
    invalid = [values for values, p in told.items() if p["status"] == "invalid"]
    assert invalid == [("1 m", 5, 4), ("10 m", 5, 4)]
    assert "note: requirement.0.limit=10 m, plan.repeats.least=5, plan.repeats.most=4: no plan" in result.err
    assert "spec.yaml:" not in result.err  # the lines of a point's spec are those of no file


def test_a_sweep_without_any_spec_is_refused(run, spec, tmp_path):
    result = run("sweep", spec, "--vary", "requirement.0.limit=1,2 s", "-o", tmp_path / "out")
    assert result.code == 2
    assert "requirement[0].limit" in result.err


def test_a_stopped_sweep_goes_on_where_it_was(run, spec, tmp_path, monkeypatch):
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
    assert result.code == 4
    assert len(result.json["points"]) == 2
    broken = next((out / "points").iterdir())
    broken.write_text("{")  # as a crash of the disk would leave it: planned again
    monkeypatch.setattr(pipeline, "sweep", counts)
    result = run(*arguments)
    assert result.code == 0
    assert len(planned) == 3
    assert len(result.json["points"]) == 4
    assert "note: 1 of 4 points were finished before" in result.err
    monkeypatch.setattr(pipeline, "sweep", whole)
    at_once = run(*arguments[:-2], tmp_path / "at_once", "--json")
    assert at_once.out == result.out
    for name in ("sweep.csv", "sweep.json", "report.html"):
        assert (tmp_path / "at_once" / name).read_bytes() == (out / name).read_bytes()


def test_a_killed_worker_is_replaced_and_nothing_is_planned_twice(spec, monkeypatch):
    asked, points = [], points_of(load_spec(spec), ["requirement.0.limit=9..12m"], 4)

    def dies_after_two(count, function, task, chunks):
        asked.append([number for number, _ in chunks])
        for done, chunk in enumerate(chunks):
            if done == 2:
                raise BrokenProcessPool("killed")
            yield function(task, *chunk)

    monkeypatch.setattr(workers, "_pool", dies_after_two)
    found = dict(sweep(spec, points, range(4), 2, None))
    assert asked == [[0, 1, 2, 3], [2, 3]]
    assert found == dict(sweep(spec, points, range(4), 1, None))


def test_workers_that_die_again_and_again_end_the_sweep(spec, monkeypatch):
    def dies(count, function, task, chunks):
        raise BrokenProcessPool("killed")

    monkeypatch.setattr(workers, "_pool", dies)
    with pytest.raises(StoppedEarly, match="fewer --workers; the same command goes on"):
        list(sweep(spec, points_of(load_spec(spec), ["plan.seed=1,2"], 2), [0, 1], 2, None))


def test_a_point_without_an_answer_in_time_is_told_and_tried_again(run, spec, monkeypatch):
    import planner.pipelines.sweep as pipeline

    def late(loaded):
        raise StoppedEarly("nothing found within 1 s; give plan.time_limit more")

    real = pipeline.exact_plan
    monkeypatch.setattr(pipeline, "exact_plan", late)
    arguments = ("sweep", spec, "--vary", "requirement.0.limit=9,10m", "-o", "out", "--json")
    result = run(*arguments)
    assert result.code == 4
    assert [p["status"] for p in result.json["points"]] == ["stopped", "stopped"]
    assert "requirement.0.limit=9 m: no plan: nothing found within 1 s" in result.err
    monkeypatch.setattr(pipeline, "exact_plan", real)
    again = run(*arguments)
    assert again.code == 0
    assert [p["status"] for p in again.json["points"]] == ["planned", "planned"]


def test_another_sweep_in_the_folder_keeps_its_points(run, spec, tmp_path):
    first = ("sweep", spec, "--vary", "requirement.0.limit=9,10m", "-o", "out", "--json")
    told = run(*first).out
    other = run("sweep", spec, "--vary", "plan.confidence=90,99%", "-o", "out")
    assert other.code == 0
    assert "note: out held a sweep of spec over requirement.0.limit; its 2 points stay" in other.err
    again = run(*first)
    assert again.out == told
    assert "2 of 2 points were finished before" in again.err


@pytest.mark.parametrize(("name", "content"), [("report.html", "of a plan"), ("sweep.json", "[]")])
def test_files_of_no_sweep_are_not_replaced(run, spec, tmp_path, name, content):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text(content)
    result = run("sweep", spec, "--vary", "requirement.0.limit=9,10m", "-o", "out")
    assert result.code == 2
    assert f"out/{name}  is not of planner's making" in result.err
    assert (tmp_path / "out" / name).read_text() == content
    assert not (tmp_path / "out/points").exists()
    forced = run("sweep", spec, "--vary", "requirement.0.limit=9,10m", "-o", "out", "--force")
    assert forced.code == 0
    assert json.loads((tmp_path / "out/sweep.json").read_text())["wanted"] == 2


def test_another_flight_under_the_same_name_is_another_sweep(tmp_path):
    file = tmp_path / "spec.yaml"
    file.write_text(yaml.safe_dump(small(trajectory={"file": "flight.csv"}), sort_keys=False))
    digests = set()
    for north in (0.0, 1e-5):  # deg further in the end
        rows = [f"{t},{45 + north * t / 40},{30 + 1e-4 * t},100" for t in range(0, 41)]
        (tmp_path / "flight.csv").write_text("\n".join(["time_s,lat_deg,lon_deg,alt_m", *rows]))
        digests.add(points_of(load_spec(file), ["requirement.0.limit=9m"], 1)[0].digest)
    assert len(digests) == 2


@pytest.mark.parametrize("command", ["sweep", "verify"])
def test_no_workers_are_refused(run, spec, command):
    more = ("--vary", "plan.seed=1,2") if command == "sweep" else (spec,)
    result = run(command, spec, *more, "--workers", 0)
    assert result.code == 2
    assert "--workers 0" in result.err


def test_workers_find_the_same(run, spec, tmp_path):
    vary = ("--vary", "requirement.0.limit=9..12m", "--points", 3, "--json")
    one, two = (run("sweep", spec, *vary, "-o", tmp_path / str(n), "--workers", n) for n in (1, 2))
    assert one.code == two.code == 0
    assert one.out == two.out
    assert (tmp_path / "1" / "report.html").read_bytes() == (tmp_path / "2" / "report.html").read_bytes()


def test_a_wrong_spec_is_refused_with_its_place(run, tmp_path):
    file = tmp_path / "spec.yaml"
    file.write_text("planner: 1\nname: 5\n")
    result = run("sweep", file, "--vary", "name=1,2", "-o", tmp_path / "out")
    assert result.code == 2
    assert not (tmp_path / "out").exists()


def test_kept_points_are_of_their_own_spec(spec, tmp_path):
    (point,) = points_of(load_spec(spec), ["requirement.0.limit=9m"], 1)
    file = sweeping._file(tmp_path, point.digest)
    file.parent.mkdir()
    file.write_text(json.dumps({"digest": "another"}))
    assert sweeping._kept(tmp_path, point.digest) is None
