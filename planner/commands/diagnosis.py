"""The commands that close the loop, no arithmetic: diagnose, update."""

from __future__ import annotations

import typer


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
