"""Linear algebra on one thread: what the program solves is small and many.

Threads of a BLAS wait for one another by spinning. On two cores beside other work a plan of the starter took
8 s of processor time on one thread and 26 s on two, and three times as long by the clock; sums that are split
over threads also differ in the last bit from machine to machine.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any


@contextmanager
def one_thread() -> Iterator[None]:
    """One thread for every BLAS within; also a decorator. What was before comes back."""
    import scipy.linalg  # noqa: F401 - a BLAS of its own, which can only be told once it is loaded

    with _controller(len(sys.modules)).limit(limits=1, user_api="blas"):
        yield


@lru_cache(maxsize=1)
def _controller(modules: int) -> Any:
    """Of the libraries that so many modules loaded: to look for them takes 10 ms, and it is asked often."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
