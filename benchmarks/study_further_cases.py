"""Tests that run a sample of their cases (`@pytest.mark.further`), here run with all of them.

Run: OMP_NUM_THREADS=1 python benchmarks/study_further_cases.py [tests/a_folder ...] [-k WORDS]
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.further import whole

ROOT = Path(__file__).parents[1]


class FurtherCases:
    """Completes the samples before pytest makes tests of them; what has no further cases is not run."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        definition = metafunc.definition
        if any(mark.name == "further" for mark in definition.own_markers):
            definition.own_markers[:] = whole(definition.own_markers)

    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        wanted = [item for item in items if any(m.name == "further" for m in of_function(item))]
        config.hook.pytest_deselected(items=[item for item in items if item not in wanted])
        items[:] = wanted


def of_function(item: pytest.Item) -> list[pytest.Mark]:
    """The marks of the function that a test calls."""
    return getattr(getattr(item, "function", None), "pytestmark", [])


def with_further_cases(folders: list[str]) -> list[str]:
    """The files of tests that have further cases."""
    paths = [ROOT / folder for folder in folders] or [ROOT / "tests"]
    files = [
        file for path in paths for file in ([path] if path.is_file() else sorted(path.rglob("test_*.py")))
    ]
    return [str(file) for file in files if "@pytest.mark.further(" in file.read_text(encoding="utf-8")]


if __name__ == "__main__":
    words = sys.argv[1:]
    start = next((i for i, word in enumerate(words) if word.startswith("-")), len(words))
    options = ["-n", "0", "--rootdir", str(ROOT), *words[start:]]
    raise SystemExit(pytest.main([*options, *with_further_cases(words[:start])], plugins=[FurtherCases()]))
