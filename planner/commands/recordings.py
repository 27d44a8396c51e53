"""The command for raw recordings, no arithmetic: reduce."""

from __future__ import annotations

import typer


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
