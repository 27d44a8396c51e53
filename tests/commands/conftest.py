"""A small spec in the folder of a test."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.commands.specs import written
from tests.specs import small


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    return written(tmp_path / "campaign.yaml", small())
