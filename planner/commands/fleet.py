"""The commands for units after the campaign, no arithmetic: accept, forecast."""

from __future__ import annotations

import typer


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
