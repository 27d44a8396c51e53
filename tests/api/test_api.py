"""`import planner` for scripts: light, complete, the same answers as the command line."""

from __future__ import annotations

import ast
import inspect
import json
import subprocess
import sys
from pathlib import Path

import pytest

import planner
from planner.cli import app
from planner.spec.load import LoadedSpec
from tests.outcome import Run
from tests.specs import SHIPPED, small

STUB = Path(planner.__file__).with_suffix(".pyi")
COMMANDS = {c.callback.__name__: c.callback for c in app.registered_commands if c.callback}
# what people do with files and devices, and `effects`, whose name is that of the effects themselves
OF_THE_COMMAND_LINE = {"init", "docs", "run", "bench_simulator", "bench_check", "effects", "explain"}
OF_THE_OUTPUT = {"as_json", "out", "guess", "map_help", "plan_check"}
OTHER_NAMES = {
    "latitude": "latitude_deg",
    "turn": "turn_deg",
    "assign": "settings",
    "case": "settings",
    "signs": "settings",
    "temperature_error": "settings",
    "spikes": "settings",
    "exit_code": "strict",
    "calibration": "history",
    "load": None,  # of plan_check
    "decided": None,
    "signals": "form",
    "rate": "rate_hz",
}
OTHER_VERBS = {"simulate": planner.simulate_signals}  # with --signals the command answers another thing


@pytest.fixture(scope="module")
def spec() -> planner.Spec:
    return planner.load(small())


@pytest.fixture(scope="module")
def made(spec):
    return spec.plan()


# ---------------------------------------------------------------- the surface


def test_import_planner_imports_nothing_else():
    code = "import sys; before = set(sys.modules); import planner; print(sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    new = {name.partition(".")[0] for name in ast.literal_eval(done.stdout)}
    assert new <= {"planner", *sys.stdlib_module_names}
    assert len(ast.literal_eval(done.stdout)) < 40


def test_the_stub_says_the_types_of_what_there_is():
    tree = ast.parse(STUB.read_text(encoding="utf-8"))
    told = {alias.asname for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert told | {"__version__"} == set(planner.__all__)
    for node in (node for node in tree.body if isinstance(node, ast.ImportFrom)):
        for alias in node.names:
            there = getattr(__import__(node.module, fromlist=[alias.name]), alias.name)
            offered = getattr(planner, alias.name)
            assert callable(offered)
            assert offered is there or inspect.signature(offered) == inspect.signature(there), alias.name


def test_a_verb_stays_callable_when_the_package_of_its_name_is_imported(spec):
    import planner.plan.budget
    import planner.verify.recount

    assert inspect.ismodule(planner.plan)
    assert inspect.ismodule(planner.verify)
    assert planner.plan.budget.__name__ == "planner.plan.budget"
    assert planner.plan(spec).time_s > 0
    assert "flights" in inspect.signature(planner.verify).parameters


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - OF_THE_COMMAND_LINE))
def test_what_a_command_takes_its_function_takes(command):
    asked = set(inspect.signature(COMMANDS[command]).parameters) - OF_THE_OUTPUT
    verbs = [getattr(planner, command), *([OTHER_VERBS[command]] if command in OTHER_VERBS else [])]
    taken = {name for verb in verbs for name in inspect.signature(verb).parameters}
    assert {OTHER_NAMES.get(name, name) for name in asked - taken} - {None} <= taken


@pytest.mark.parametrize("verb", [name for name in planner.__all__ if not name.startswith("_")])
def test_every_verb_is_documented(verb):
    assert inspect.getdoc(getattr(planner, verb))


# ---------------------------------------------------------------- the answers


def test_a_plan_from_python_is_the_plan_of_the_command_line(run: Run, made, tmp_path):
    import yaml

    (tmp_path / "spec.yaml").write_text(yaml.safe_dump(small(), sort_keys=False))
    found = run("plan", "spec.yaml", "-o", "out", "--json")
    theirs, ours = found.json, made.to_dict()
    assert found.envelope["command"] == "plan"
    of_text = {"spec", "plan_sha256"}  # the digests are of another text that says the same
    assert {k: v for k, v in theirs.items() if k not in of_text} == {
        k: v for k, v in json.loads(json.dumps(ours)).items() if k not in of_text
    }
    made.save(tmp_path / "by_api")
    by_api, by_command = ({p.name for p in (tmp_path / name).iterdir()} for name in ("by_api", "out"))
    assert by_api == by_command
    assert json.loads((tmp_path / "by_api" / "plan.json").read_text())["steps"] == theirs["steps"]


def test_a_spec_has_the_verbs_as_methods(spec, made):
    assert isinstance(spec, LoadedSpec)
    assert spec.plan().to_dict() == made.to_dict() == planner.plan(small()).to_dict()
    assert "flights" in inspect.signature(spec.verify).parameters
    assert "spec" not in inspect.signature(spec.verify).parameters
    assert spec.check() == ()


def test_tables_pages_and_notebooks(made):
    pd = pytest.importorskip("pandas")
    steps = made.to_pandas()
    assert isinstance(steps, pd.DataFrame)
    assert list(steps["id"]) == [step.id for step in made.steps]
    shown = made._repr_html_()
    assert made.reports[0].answer in shown
    assert "<script" not in shown
    assert "planner.plan(" in planner.report(made, command="planner.plan(spec)")
    assert made.reports[0].answer.removesuffix(".") in str(made)


def test_what_stands_in_a_spec_is_shown_as_text():
    named = planner.load(small(name="<b>bold</b> & co"))
    assert "<b>bold" not in named._repr_html_()


def test_a_changed_spec_is_another(spec):
    other = spec.having({"requirement.0.limit": "12 m", "plan.confidence": "90 %"})
    assert other.spec.requirement[0].limit.si == 12.0
    assert spec.spec.requirement[0].limit.si == 10.0
    with pytest.raises(planner.InputError, match="confidance"):
        spec.having({"plan.confidance": "90 %"})


def test_faults_of_a_spec_built_in_python_have_their_places():
    with pytest.raises(planner.InputError) as found:
        planner.load(small(effects=["bais"]) | {"nam": "x"})
    assert len(found.value.faults) >= 2
    assert all(fault.line for fault in found.value.faults)
    with pytest.raises(planner.InputError, match="lists and mappings"):
        planner.load(small(name=object()))


def test_a_spec_of_the_sensor_alone_says_what_it_lacks():
    alone = planner.load({key: small()[key] for key in ("planner", "unit", "effects")})
    assert "trajectory" in alone.absent
    with pytest.raises(planner.InputError) as found:
        alone.plan()
    assert {"requirement", "benches"} <= {fault.path for fault in found.value.faults}


def test_a_loop_in_python(tmp_path):
    spec = planner.load(SHIPPED / "close_the_loop.yaml")
    simulated = spec.simulate(seed=5)
    table, truth = simulated.save(tmp_path / "data.csv")
    assert truth.exists()
    calibration = planner.calibrate(table, spec)
    frame = calibration.to_pandas()
    known = frame[frame["status"] != "undetermined"]
    assert (known["ci95_low"] <= known["value"]).all()
    calibration.save(tmp_path / "cal")
    corrected = planner.apply(tmp_path / "cal", table, tmp_path / "corrected.csv")
    assert len(corrected.rows()) == len(simulated.table)


def test_plans_are_compared_as_files_trees_and_answers(made, tmp_path):
    made.save(tmp_path)
    found = planner.compare(tmp_path, made, made.to_dict())
    assert not found.differ
    assert found.exit_code == 0
    with pytest.raises(planner.InputError, match="no plan"):
        planner.compare(made, 3)
