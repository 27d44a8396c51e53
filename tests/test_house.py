"""The house keeps its own rules: plug-ins that explain themselves, a light start, a README that is true."""

from __future__ import annotations

import ast
import importlib
import json
import pkgutil
import re
import shlex
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from typer.testing import CliRunner

from planner import catalog
from planner.cli import app

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "planner").rglob("*.py"))
PLUGIN_PACKAGES = ("planner.effects", "planner.trajectories", "planner.benches", "planner.export.formats")
# typer brings pydantic along when it reads arguments, so pydantic is no sign of our own doing there
HEAVY = {
    "numpy",
    "scipy",
    "pint",
    "yaml",
    "cvxpy",
    "deap",
    "matplotlib",
    "jinja2",
    "h5py",
    "pyarrow",
}
COMMANDS = {(c.name or c.callback.__name__).replace("_", "-") for c in app.registered_commands if c.callback}


def plugin_modules() -> list[ModuleType]:
    """Every module of the plug-in packages that offers something."""
    return [
        importlib.import_module(f"{package}.{info.name}")
        for package in PLUGIN_PACKAGES
        for info in pkgutil.iter_modules(importlib.import_module(package).__path__)
        if not info.name.startswith("_")
    ]


# ---------------------------------------------------------------- plug-ins


@pytest.mark.parametrize("module", plugin_modules(), ids=lambda module: module.__name__)
def test_a_plug_in_says_what_it_is(module: ModuleType) -> None:
    assert module.__doc__
    assert len(module.__doc__.split()) >= 5  # a sentence
    (offer,) = (
        getattr(module, name) for name in ("EFFECT", "FAMILY", "KIND", "FORMAT") if hasattr(module, name)
    )
    assert type(offer).__doc__
    assert offer.name == module.__name__.rpartition(".")[2]  # a stranger finds the file by the name


@pytest.mark.parametrize("name", catalog.effects())
def test_an_effect_shows_its_equation_or_its_source(name: str) -> None:
    effect = catalog.effects()[name]
    text = f"{sys.modules[type(effect).__module__].__doc__}\n{type(effect).__doc__}"
    assert re.search(r"[=+·]|\bK \d|\bK table|IEEE", text), name


# ---------------------------------------------------------------- imports


def loaded_by(*arguments: str) -> set[str]:
    """Top-level packages that `planner` with these arguments has imported when it ends."""
    code = (
        "import sys, json\n"
        "from planner.cli import main\n"
        f"sys.argv = ['planner', *{list(arguments)!r}]\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print('\\n' + json.dumps(sorted({name.partition('.')[0] for name in sys.modules})))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize(
    "arguments", [["--help"], ["--version"], ["plan", "--help"], ["nosuch"]], ids=" ".join
)
def test_help_imports_nothing_heavy(arguments: list[str]) -> None:
    assert not loaded_by(*arguments) & HEAVY


def test_a_spec_is_checked_without_the_solvers() -> None:
    found = loaded_by("check", str(ROOT / "requirements_specs" / "published_optimum.yaml"))
    assert "pydantic" in found  # it did something
    assert not found & {"scipy", "cvxpy", "deap", "matplotlib", "jinja2", "sklearn", "statsmodels"}


@pytest.fixture(scope="module")
def sources() -> dict[str, tuple[str, ast.Module]]:
    """Path of every module -> its text and tree: a test of each module would take five times as long."""
    texts = {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in SOURCES}
    return {path: (text, ast.parse(text)) for path, text in texts.items()}


def imported_at_the_top(tree: ast.Module) -> set[str]:
    """Packages that a module imports as it is loaded."""
    top = [n for n in tree.body if isinstance(n, ast.Import | ast.ImportFrom)]
    named = {a.name for n in top if isinstance(n, ast.Import) for a in n.names}
    named |= {n.module or "" for n in top if isinstance(n, ast.ImportFrom)}
    return {name.partition(".")[0] for name in named}


def test_nothing_heavy_is_imported_at_the_top_of_a_module(sources: dict[str, tuple[str, ast.Module]]) -> None:
    """Heavy packages are imported where they are used; numpy and pydantic are what modules are made of."""
    heavy = {"cvxpy", "deap", "matplotlib", "scipy", "pyarrow", "h5py"}
    assert len(sources) > 500
    assert {
        path: named for path, (_, t) in sources.items() if (named := imported_at_the_top(t) & heavy)
    } == {}


def test_every_module_says_what_it_is_for_and_stays_short(sources: dict[str, tuple[str, ast.Module]]) -> None:
    mine = {path: found for path, found in sources.items() if not path.endswith("__init__.py")}
    assert [path for path, (_, tree) in mine.items() if not ast.get_docstring(tree)] == []
    # the aim is 400; commands and records are lists
    assert {path: n for path, (text, _) in mine.items() if (n := len(text.splitlines())) > 500} == {}


# ---------------------------------------------------------------- exceptions from the rules

EXCEPTION = re.compile(r"# (?:type: ignore|(?:ruff: )?noqa)|except (?:Base)?Exception\b")
SILENCED = r"# type: ignore\[[\w, -]+\]  #|# (?:ruff: )?noqa: [A-Z]+\d+ +[-(]"
CAUGHT = r"except (?:Base)?Exception(?: as \w+)?:  #"
WITH_A_REASON = re.compile(rf"(?:{SILENCED}|{CAUGHT}) *\S+ \S")


def exceptions(folder: str) -> dict[str, str]:
    """file:line -> line, of what silences a checker or catches everything; not here, where they are told."""
    return {
        f"{file.relative_to(ROOT)}:{number}": line.strip()
        for file in sorted((ROOT / folder).rglob("*.py"))
        if file != Path(__file__)
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if EXCEPTION.search(line)
    }


def test_every_exception_from_a_rule_gives_its_reason() -> None:
    found = {**exceptions("planner"), **exceptions("tests"), **exceptions("benchmarks")}
    assert found
    assert {place: line for place, line in found.items() if not WITH_A_REASON.search(line)} == {}


# ---------------------------------------------------------------- README and workplace


def readme() -> str:
    return (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_readmes_first_lines_install_run_and_test() -> None:
    first, second = re.findall(r"^python3 -m venv .*$", readme(), re.MULTILINE)[:2]
    assert first.endswith("planner plan requirements_specs/small_uav.yaml")
    assert second.endswith("pytest")


def test_every_command_of_the_readme_exists() -> None:
    named = set(re.findall(r"(?:^|`|/)planner ([a-z][a-z-]*)", readme(), re.MULTILINE))
    assert named
    assert named <= COMMANDS


def test_every_file_that_the_readme_names_exists() -> None:
    named = re.findall(r"`((?:planner|tests|benchmarks|requirements_specs)/[\w./]+)`", readme())
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_every_spec_that_the_readme_names_is_shipped() -> None:
    shipped = {file.stem for file in (ROOT / "requirements_specs").glob("*.yaml")}
    named = set(re.findall(r"`(published_\w+)`", readme()))
    assert named
    assert {name for name in named if not name.endswith("_")} <= shipped


def test_the_figures_beside_the_readmes_picture_are_those_of_the_plan(tmp_path: Path) -> None:
    """So is the picture, if whoever changes them takes it anew."""
    spec = ROOT / "requirements_specs" / "small_uav.yaml"
    made = CliRunner().invoke(app, ["plan", str(spec), "-o", str(tmp_path / "plan")])
    assert made.exit_code == 0, made.output
    said = re.search(r"report: ([\d.]+) h, no other below ([\d.]+) h; (\d+) of (\d+) m promised", readme())
    assert said is not None
    hours, below, promised, limit = said.groups()
    assert f"{hours} h. The shortest found." in made.stdout
    assert f"none takes less than {below} h" in made.stdout
    shown = re.search(r"position: ([\d.]+) m <= (\d+) m", made.stdout)
    assert shown is not None
    assert (f"{float(shown[1]):.0f}", shown[2]) == (promised, limit)


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_the_example_of_a_command_is_a_command_line_that_it_takes(command: str) -> None:
    callback = next(
        c.callback
        for c in app.registered_commands
        if c.callback and c.callback.__name__ == command.replace("-", "_")
    )
    assert callback.__doc__
    example = callback.__doc__.partition("Example: planner ")[2].partition("\n\n")[0]
    words = shlex.split(" ".join(example.split()).partition(">")[0])
    options = {word for word in words if word.startswith("-") and not re.match(r"-\d", word)}
    help_text = CliRunner().invoke(app, [command, "--help"]).stdout
    assert words[0] == command
    assert all(re.search(rf"(^|\s|,){re.escape(option)}\b", help_text) for option in options)
