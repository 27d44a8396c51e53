"""Packages laid into a folder as an installer lays them there: the modules, and what it says of itself."""

from __future__ import annotations

import os
import shutil
import sys
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from planner import catalog

ROOT = Path(__file__).parents[2]
EXAMPLE = Path(__file__).parent / "example_package"


@dataclass(frozen=True)
class Installed:
    """A folder of installed packages, and the environment in which another process finds them."""

    folder: Path

    @property
    def environment(self) -> dict[str, str]:
        path = os.pathsep.join([str(self.folder), str(ROOT)])
        return {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1"}


def install(source: Path, folder: Path) -> None:
    """What `pip install --target` leaves of a package in pure Python, with no backend and no network."""
    project = tomllib.loads((source / "pyproject.toml").read_text())
    for package in project["tool"]["setuptools"].get("packages", []):
        shutil.copytree(source / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    for module in project["tool"]["setuptools"].get("py-modules", []):
        shutil.copy(source / f"{module}.py", folder)
    about = project["project"]
    offer(folder, about["name"], about["version"], about["entry-points"])


def offer(folder: Path, name: str, version: str, groups: dict[str, dict[str, str]]) -> None:
    """The metadata of a distribution."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [
        f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in own.items()) for group, own in groups.items()
    ]
    (info / "entry_points.txt").write_text("\n".join(lines))
    (info / "INSTALLER").write_text("test\n")


@contextmanager
def found_in(folder: Path) -> Iterator[Installed]:
    """The folder on the path of this process, and forgotten again."""
    before = set(sys.modules)
    sys.path.insert(0, str(folder))
    catalog.forget()
    try:
        yield Installed(folder)
    finally:
        sys.path.remove(str(folder))
        for name in set(sys.modules) - before:
            if str(getattr(sys.modules[name], "__file__", "")).startswith(str(folder)):
                del sys.modules[name]
        catalog.forget()
