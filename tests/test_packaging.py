"""What is installed is what is tested: sdist and wheel, built here, tried where planner is nowhere else."""

from __future__ import annotations

import os
import site
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from pathlib import Path

import pytest

from tests.specs import ROOT

pytest.importorskip("hatchling", reason="hatchling, the build backend, is in the extra `test`")


def called(*command: object, **more: object) -> str:
    """stdout of a command that must end well, without this tree on its path."""
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PLANNER_DEBUG")}
    done = subprocess.run(
        [str(word) for word in command], env=clean, capture_output=True, text=True, timeout=120, **more
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The sdist of this tree, and the wheel that is built from that sdist alone."""
    place = tmp_path_factory.mktemp("built")
    called(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", place, cwd=ROOT)
    (sdist,) = place.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(place, filter="data")
    source = place / sdist.name.removesuffix(".tar.gz")
    called(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", place, cwd=source)
    (wheel,) = place.glob("*.whl")
    return sdist, wheel


def test_the_wheel_has_every_file_of_the_package_and_nothing_else(built: tuple[Path, Path]) -> None:
    sdist, wheel = built
    here = {
        str(file.relative_to(ROOT))
        for file in (ROOT / "planner").rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert names == here
    assert {"planner/docs/tutorial.md", "planner/rules/form.toml", "planner/spec/starter.yaml"} <= names
    assert {"planner/py.typed", "planner/__init__.pyi", "planner/commands/help.txt"} <= names
    with tarfile.open(sdist) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert {"README.md", "LICENSE", "CITATION.cff", "requirements_specs/small_uav.yaml"} <= inside
    assert any(name.startswith("tests/") for name in inside)


def test_the_wheel_works_where_nothing_else_of_planner_is(built: tuple[Path, Path], tmp_path: Path) -> None:
    home = tmp_path / "clean"
    called(sys.executable, "-m", "venv", "--without-pip", home)
    python = home / "bin" / "python"
    called(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", built[1])
    (packages,) = (home / "lib").glob("python*/site-packages")
    # the packages that it depends on are those of this Python: to install them takes a minute
    others = [sysconfig.get_path("purelib"), *site.getsitepackages()]
    (packages / "others.pth").write_text("\n".join(dict.fromkeys(others)) + "\n")
    where = called(python, "-c", "import planner; print(planner.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(home)
    planner = home / "bin" / "planner"
    assert called(planner, "--version", cwd=tmp_path).strip() == built[1].name.split("-")[1]
    assert "  migrate " in called(planner, "--help", cwd=tmp_path)
    called(planner, "init", "spec.yaml", cwd=tmp_path)
    sheet = ("--gyro-bias-instability", "5 deg/h", "--accelerometer-bias-instability", "0.1 mg")
    called(planner, "init", "unit.yaml", "--from-datasheet", *sheet, cwd=tmp_path)
    assert "no faults" in called(planner, "check", "spec.yaml", cwd=tmp_path)
    assert "P111" in called(planner, "explain", "P111", cwd=tmp_path)
    assert "data sheet" in called(planner, "docs", "tutorial", cwd=tmp_path)
