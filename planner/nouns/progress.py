"""Who is told how far a long piece of work has come: one line of text at a time."""

from collections.abc import Callable

Progress = Callable[[str], None]


def silent(message: str) -> None:
    """Progress that nobody watches."""
