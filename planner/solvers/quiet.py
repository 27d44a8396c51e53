"""Keeps a solver's own printing out of our results."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def nothing_on_stdout() -> Iterator[None]:
    """HiGHS prints some lines of its own whatever its options say, in the midst of our results on stdout."""
    try:
        sys.stdout.flush()
        kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    except (OSError, ValueError):  # stdout is closed: nothing to protect
        yield
        return
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        with suppress(Exception):  # its lines wait in C's own buffer; where C is not to be had they may show
            ctypes.CDLL(None).fflush(None)
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
