"""The commands that put a plan's promise to the test, no arithmetic: verify, sweep."""

from __future__ import annotations

import typer


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
