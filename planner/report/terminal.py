"""How wide a terminal is taken to be."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console


@contextmanager
def room(console: Console, width: int) -> Iterator[None]:
    """At least `width` columns unless it is a terminal: a file or a pipe has no width to fit."""
    before = console.width
    if not console.is_terminal:
        console.width = max(before, width)
    try:
        yield
    finally:
        console.width = before
