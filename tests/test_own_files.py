"""What a command writes replaces planner's own files for the same spec, and nobody else's."""

import json

import pytest
import yaml

import planner
from planner import own_files
from planner.errors import InputError
from planner.own_files import LIST, write_own
from tests.specs import small


def written(path, tree):
    path.parent.mkdir(exist_ok=True)
    path.write_text(yaml.safe_dump(tree, sort_keys=False))
    return path


@pytest.fixture
def spec(tmp_path):
    return written(tmp_path / "spec.yaml", small())


def write(path, text, of, **options):
    write_own({path: text}, of, **options)


def left_alone(path, of, *words, **options):
    """The file is refused with these words, in a coded fault that tells the remedy, and stays."""
    before = path.read_bytes()
    with pytest.raises(InputError) as refusal:
        write(path, "new", of, **options)
    (fault,) = refusal.value.faults
    assert (fault.file, fault.code) == (str(path), "P010")
    assert all(word in fault.wrong for word in words), fault.wrong
    assert "--force" in fault.remedy
    assert path.read_bytes() == before


# ---------------------------------------------------------------- whose a file is


def test_what_planner_wrote_is_replaced_and_what_it_did_not_is_refused(tmp_path, spec):
    out = tmp_path / "out" / "curves.csv"
    write(out, "old", spec)
    write(out, "new", spec)
    assert out.read_text() == "new"
    out.write_text("edited by hand")
    left_alone(out, spec, "is not of planner's making")
    write(out, "new", spec, force=True)
    assert out.read_text() == "new"
    write(out, "newer", spec)


@pytest.mark.parametrize("change", [("name: ", "name: another "), ("10 m", "11 m")])
def test_a_spec_is_its_file_whatever_is_edited_in_it(tmp_path, spec, change):
    out = tmp_path / "out" / "plan.json"
    write(out, json.dumps({"planner": "1", "spec": {"name": "small", "sha256": "0"}}), spec)
    spec.write_text(spec.read_text().replace(*change))
    write(out, "{}", spec)
    assert out.read_text() == "{}"


def test_a_spec_of_the_same_name_and_text_in_another_file_is_another(tmp_path, spec):
    out, other = tmp_path / "out" / "report.html", tmp_path / "b" / "spec.yaml"
    other.parent.mkdir()
    other.write_bytes(spec.read_bytes())
    write(out, "of the first", spec)
    left_alone(out, other, "is of ../spec.yaml, not of spec.yaml")


def test_a_tree_that_is_moved_stays_its_own(tmp_path):
    spec = written(tmp_path / "a" / "spec.yaml", small())
    write(tmp_path / "a" / "out" / "x.csv", "old", spec)
    (tmp_path / "a").rename(tmp_path / "b")
    moved = tmp_path / "b"
    write(moved / "out" / "x.csv", "new", moved / "spec.yaml")
    assert (moved / "out" / "x.csv").read_text() == "new"


def test_the_file_that_was_named_goes_and_its_neighbours_stay(tmp_path, spec):
    named, beside = tmp_path / "mine.txt", tmp_path / "operator.html"
    named.write_text("of mine")
    beside.write_text("my own notes")
    with pytest.raises(InputError, match=r"operator\.html  is not of planner's making"):
        write_own({named: "new", beside: "new"}, spec, named)
    assert (named.read_text(), beside.read_text()) == ("of mine", "my own notes")
    beside.write_text("<p>plan_sha256: 00</p>")
    write_own({named: "new", beside: "new"}, spec, named)
    assert not (tmp_path / LIST).exists()


def test_the_same_content_is_nobodys_loss(tmp_path, spec):
    (tmp_path / "a.csv").write_text("same")
    write(tmp_path / "a.csv", "same", spec)


# ---------------------------------------------------------------- without a list, by content

PAGE = "<footer><p>Made by planner 0.1.0: <code>planner {}</code></p></footer>"
OF_IT = {
    "plan.json": '{"planner": "0.1.0", "spec": {"name": "small", "sha256": "0"}}',
    "report.html": PAGE.format("verify --made-for=old.yaml spec.yaml plan.json"),
    "steps.csv": "id,plan_sha256",
}
OF_ANOTHER = {
    "plan.json": '{"planner": "0.1.0", "spec": {"name": "large", "sha256": "0"}}',
    "report.html": PAGE.format("plan &#39;a spec.yaml.yaml&#39;"),
}
OF_NOBODY = {
    "plan.json": '{"plan": "of my holidays", "spec": {"name": "small"}}',
    "report.html": "<p>Made by planner</p>",
    "steps.csv": "one, two",
    LIST.replace(".json", ".csv"): "",
}


@pytest.mark.parametrize("name", OF_IT)
def test_an_older_file_is_known_by_what_it_says(tmp_path, spec, name):
    (tmp_path / name).write_text(OF_IT[name])
    write(tmp_path / name, "new", spec)
    assert (tmp_path / name).read_text() == "new"


@pytest.mark.parametrize("name", OF_ANOTHER)
def test_an_older_file_of_another_spec_is_refused(tmp_path, spec, name):
    (tmp_path / name).write_text(OF_ANOTHER[name])
    left_alone(tmp_path / name, spec, "is of ", "not of spec.yaml")


@pytest.mark.parametrize("name", OF_NOBODY)
def test_a_file_that_does_not_say_is_somebodys(tmp_path, spec, name):
    (tmp_path / name).write_text(OF_NOBODY[name])
    left_alone(tmp_path / name, spec, "is not of planner's making")


@pytest.mark.parametrize("broken", ["", "[]", '{"files": []}', '{"files": {"a.csv": 1}}', "{" * 9999])
def test_a_list_that_is_none_lists_nothing(tmp_path, spec, broken):
    (tmp_path / "a.csv").write_text("mine")
    (tmp_path / LIST).write_text(broken)
    left_alone(tmp_path / "a.csv", spec, "is not of planner's making")


def test_a_table_without_a_name_goes_with_its_page(tmp_path, spec):
    (tmp_path / "report.html").write_text(OF_IT["report.html"])
    (tmp_path / "curves.csv").write_text("error,axis")
    write_own({tmp_path / "report.html": "new", tmp_path / "curves.csv": "new"}, spec)
    assert (tmp_path / "curves.csv").read_text() == "new"


# ---------------------------------------------------------------- commands


def test_plan_again_after_an_edit_needs_no_word(run, tmp_path, spec):
    assert run("plan", spec, "-o", "out").code == 0
    text = spec.read_text()
    spec.write_text(text.replace("name: small", "name: renamed").replace("10 m", "11 m"))
    assert run("plan", spec, "-o", "out").code == 0
    assert json.loads((tmp_path / "out" / "plan.json").read_text())["spec"]["name"] == "renamed"


def test_plan_into_the_folder_of_another_spec_is_refused_before_it_plans(run, tmp_path, spec, monkeypatch):
    run("plan", spec, "-o", "out")
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    other = written(tmp_path / "other.yaml", small())
    with monkeypatch.context() as patched:
        patched.setattr("planner.pipelines.planning.plan", pytest.fail)
        refused = run("plan", other, "-o", "out", "--json")
    assert refused.code == 2
    faults = refused.envelope["faults"]
    assert [(f["code"], f["file"]) for f in faults] == [
        ("P010", f"out/{name}") for name in ("plan.json", "report.html", "steps.csv")
    ]
    assert {f["message"] for f in faults} == {"is of ../spec.yaml, not of other.yaml"}
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    assert run("plan", other, "-o", "out", "--force").code == 0
    assert run("plan", other, "-o", "out").code == 0


@pytest.mark.parametrize(
    "command",
    [
        ("plan", "{spec}"),
        ("sensitivity", "{spec}"),
        ("verify", "{spec}", "{plan}", "--flights", "0"),
        ("compare", "{plan}", "{plan}"),
        ("diagnose", "{data}", "--spec", "{spec}"),
        ("accept", "--spec", "{spec}", "--plan"),
        ("look", "{data}"),
        ("sweep", "{spec}", "--vary", "plan.seed=1,2"),
    ],
    ids=lambda words: words[0],
)
def test_somebodys_page_is_left_alone_by(command, run, tmp_path, spec, made):
    data = tmp_path / "data.csv"
    data.write_text("time_s,gx\n" + "".join(f"{n / 10},0.0\n" for n in range(600)))
    page = tmp_path / "out" / "report.html"
    page.parent.mkdir()
    page.write_text("<h1>Mine</h1>")
    words = [word.format(spec=spec, data=data, plan=made) for word in command]
    refused = run(*words, "-o", "out")
    assert (refused.code, "out/report.html  is not of planner's making" in refused.err) == (2, True)
    assert "[P010]" in refused.err
    assert page.read_text() == "<h1>Mine</h1>"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    planner.plan(small()).save(folder)
    return folder


def test_a_comparison_replaces_comparisons_and_no_plans_page(run, tmp_path, made):
    assert run("compare", made, made, "-o", "out").code == 0
    assert run("compare", made, made, made, "-o", "out").code == 0
    planned = tmp_path / "planned"
    planned.mkdir()
    (planned / "report.html").write_text(OF_IT["report.html"])
    assert run("compare", made, made, "-o", planned).code == 2


def test_what_python_saved_is_planners(run, tmp_path, spec):
    planner.load(spec).plan().save(tmp_path / "out")
    spec.write_text(spec.read_text().replace("10 m", "11 m"))
    assert run("plan", spec, "-o", "out").code == 0
    assert own_files._listed(tmp_path / "out")["steps.csv"]["of"] == "../spec.yaml"
