"""`planner effects`: what there is, of whom, with all that it says of itself."""

from __future__ import annotations

from pathlib import Path

from planner import catalog
from planner.units import to_degc, to_si
from tests.outcome import Run
from tests.plugins.installing import Installed, found_in, offer


def test_ours_and_the_packages_are_listed(installed_example: Installed, run: Run) -> None:
    done = run("effects", "--json")
    document = done.json
    found = {e["name"]: e for e in document["effects"]}
    assert set(found) == set(catalog.effects())
    assert document["unloadable"] == []
    ripple = found["ripple"]
    assert ripple["from"] == {
        "distribution": "imu-example",
        "version": "1.2.0",
        "target": "imu_example.ripple:EFFECT",
    }
    assert [p["name"] for p in ripple["parameters"]] == ["period", "phase"]
    assert found["earth_rate"]["terms"]["gyro"][0] == {"name": "up", "channels": ["x", "y", "z"]}
    assert all(e["equation"] and e["units"] and e["title"] for e in found.values())
    text = run("effects").out
    for e in found.values():
        assert e["name"] in text
        assert e["equation"] in text


def test_parameters_stand_in_their_units(installed_example: Installed, run: Run) -> None:
    for name, effect in catalog.effects().items():
        shown = {p["name"]: p for p in run("effects", name, "--json").json["parameters"]}
        for p in effect.parameters:
            text = f"{shown[p.name]['default']} {p.unit}"
            read = to_degc(text) if p.unit == "degC" else to_si(text, p.unit)
            days = 86400.0 if p.unit == "day" else 1.0
            assert abs(read - days * p.default) <= 1e-12 * abs(days * p.default)
            assert abs(p.read(p.shown(p.default)) - p.default) <= 1e-5 * abs(p.default)  # six digits


def test_one_by_its_name_and_near_its_name(installed_example: Installed, run: Run) -> None:
    assert "max(T0 − T, 0)" in run("effects", "cold_knee").out
    done = run("effects", "cold_kne")
    assert (done.code, "did you mean 'cold_knee'?" in done.err) == (2, True)


def test_what_does_not_load_is_a_note(run: Run, tmp_path: Path) -> None:
    offer(tmp_path / "site", "broken-dist", "3.1", {"planner.effects": {"broken": "nosuchmodule:EFFECT"}})
    with found_in(tmp_path / "site"):
        done = run("effects")
        assert done.code == 0
        assert "effect 'broken' of broken-dist 3.1" in done.err
        (one,) = run("effects", "--json").json["unloadable"]
        assert (one["name"], one["distribution"], one["version"]) == ("broken", "broken-dist", "3.1")
        assert run("effects", "broken").code == 2


def test_a_skeleton_of_a_name_that_is_none_or_is_taken_is_refused(run: Run) -> None:
    for name, says in (("Self-Heating", "small letters"), ("gyro", "small letters"), ("bias", "of planner")):
        done = run("effects", "--template", name)
        assert done.code == 2
        assert says in done.err
    assert run("effects", "-o", "a.py").code == 2
    assert run("effects", "bias", "--template", "b").code == 2
