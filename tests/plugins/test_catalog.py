"""Plug-ins of other packages: found by name, imported when asked for, and nobody's fault ends the program."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import yaml

from planner import catalog
from planner.errors import InputError
from tests.outcome import Run
from tests.plugins.installing import Installed, found_in, offer
from tests.specs import SHIPPED, small

EXAMPLE_EFFECTS = {"self_heating", "cold_knee", "ripple", "heat_flow"}
BROKEN = {
    "absent": ("", "nosuchmodule", "ModuleNotFoundError"),
    "raises": ("raise RuntimeError('no licence')", "raises", "RuntimeError: no licence"),
    "exits": ("import sys\nsys.exit(3)", "exits", "SystemExit: 3"),
    "objectless": ("", "objectless", "AttributeError"),
    "hollow": ("class E:\n    name = 'hollow'\nEFFECT = E()", "hollow", "it lacks bench_only, equation"),
    "classy": ("class EFFECT:\n    name = 'classy'", "classy", "offer an instance, EFFECT()"),
    "misnamed": (
        "from planner.effects.bias import Bias\nEFFECT = Bias()",
        "misnamed",
        "it calls itself 'bias' and is offered as 'misnamed'",
    ),
    "old_style": (
        "from planner.effects.warm_up import WarmUp\nclass E:\n    name = 'old_style'\n"
        "    nonlinear = {'time_constant': 600.0}\nEFFECT = E()",
        "old_style",
        r"parameters = \(Parameter\(",
    ),
    "deaf": (
        "from planner.effects.bias import Bias\nclass E(Bias):\n    name = 'deaf'\n"
        "    def regressors(self, sensor):\n        return None\nEFFECT = E()",
        "deaf",
        r"callable as regressors\(sensor, conditions, nonlinear\)",
    ),
    "termless": (
        "from planner.effects.bias import Bias\nclass E(Bias):\n    name = 'termless'\n"
        "    def terms(self, sensor):\n        return ('x', 'y', 'z')\nEFFECT = E()",
        "termless",
        "must be planner.effects.Term",
    ),
}
Offer = Callable[..., None]


@pytest.fixture
def offers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Offer]:
    """Install a module as an effect of its own distribution."""
    with ExitStack() as stack:

        def install(name: str, text: str, module: str = "", kind: str = "effects", by: str = "") -> None:
            folder = tmp_path_factory.mktemp("site")
            module = module or f"module_{name}"
            if module != "nosuchmodule":
                (folder / f"{module}.py").write_text(text + "\n")
            offer(folder, by or f"dist-{name}", "2.0", {f"planner.{kind}": {name: f"{module}:EFFECT"}})
            stack.enter_context(found_in(folder))

        yield install


def test_names_and_origins_are_read_without_importing(installed_example: Installed) -> None:
    code = (
        "import sys, json\nfrom planner import catalog\n"
        "names = {k: sorted(catalog.origins(k)) for k in catalog.KINDS}\n"
        "print(json.dumps([names, [m for m in sys.modules if m.startswith('imu_example')],\n"
        "  [m for m in sys.modules if m.startswith('planner.effects')]]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=installed_example.environment,
        capture_output=True,
        text=True,
        check=True,
    )
    names, theirs, ours = json.loads(done.stdout)
    assert set(names["effects"]) > EXAMPLE_EFFECTS | {"bias"}
    assert "glide" in names["trajectories"]
    assert "checklist" in names["exports"]
    assert theirs == []
    assert ours == []


def test_only_what_is_asked_for_is_imported(installed_example: Installed) -> None:
    assert catalog.effects()["ripple"].title == "ripple over temperature"
    assert "imu_example.ripple" in sys.modules
    assert "imu_example.cold_knee" not in sys.modules
    assert catalog.origins("effects")["ripple"].distribution == "imu-example"
    assert catalog.origins("effects")["ripple"].version == "1.2.0"
    assert set(dict(catalog.effects().items())) > EXAMPLE_EFFECTS
    assert catalog.unloadable() == []


def test_every_plug_in_of_ours_loads_under_its_modules_name() -> None:
    assert catalog.unloadable() == []
    for kind in catalog.KINDS:
        assert all(not origin.foreign for origin in catalog.origins(kind).values())


@pytest.mark.parametrize("name", BROKEN)
def test_what_does_not_load_is_an_error_where_it_is_needed_and_only_there(offers: Offer, name: str) -> None:
    text, module, says = BROKEN[name]
    offers(name, text, module)
    assert name in catalog.effects()
    assert catalog.effects()["bias"].name == "bias"
    with pytest.raises(InputError, match=says) as caught:
        catalog.effects()[name]
    assert f"{name!r} of dist-{name} 2.0" in str(caught.value)
    assert name not in dict(catalog.effects().items())
    (one,) = catalog.unloadable()
    assert (one.origin.name, one.origin.distribution) == (name, f"dist-{name}")
    assert catalog.wrong_with("effects", name) == str(caught.value)


def test_two_of_one_name_are_an_error_that_names_both(offers: Offer) -> None:
    offers("twice", "", by="first-dist")
    offers("twice", "", by="second-dist")
    with pytest.raises(InputError, match=r"first-dist 2\.0.*second-dist 2\.0|second-dist.*first-dist"):
        len(catalog.effects())


def test_ours_and_another_of_one_name_are_an_error(offers: Offer) -> None:
    offers("bias", "", by="rival")
    with pytest.raises(InputError, match=r"'bias' of planner .* 'bias' of rival 2\.0"):
        list(catalog.effects())


def test_a_spec_that_names_a_broken_plug_in_says_where(offers: Offer, run: Run, tmp_path: Path) -> None:
    offers("raises", BROKEN["raises"][0])
    sound, names = tmp_path / "sound.yaml", tmp_path / "names.yaml"
    sound.write_text(yaml.safe_dump(small()))
    names.write_text(yaml.safe_dump(small(effects=["bias", "bias_temperature", "raises"])))
    assert run("check", sound).code == 0
    done = run("check", names)
    assert done.code == 2
    assert "effects" in done.err
    assert "dist-raises 2.0" in done.err
    assert "no licence" in done.err


def test_the_names_of_other_packages_are_among_what_was_meant(
    installed_example: Installed, run: Run, tmp_path: Path
) -> None:
    wrong = small(effects=["bias", "bias_temperature", "self_heatng"], trajectory="glid")
    (tmp_path / "a.yaml").write_text(yaml.safe_dump(wrong))
    done = run("check", tmp_path / "a.yaml")
    assert done.code == 2
    assert "did you mean 'self_heating'?" in done.err
    assert "did you mean 'glide'?" in done.err


def test_a_diagnosis_says_what_it_could_not_look_for(offers: Offer, run: Run) -> None:
    """Otherwise "nothing is missing" would be false."""
    offers("raises", BROKEN["raises"][0])
    spec = SHIPPED / "close_the_loop.yaml"
    assert run("simulate", spec, "-o", "data.csv").code == 0
    done = run("diagnose", "data.csv", "--spec", spec, "-o", "found", "--json")
    assert done.code == 0, done.err
    (note,) = [note for note in done.json["notes"] if "not looked for" in note]
    assert "effect 'raises' of dist-raises 2.0" in note
    assert "no licence" in note
