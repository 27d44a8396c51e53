"""One thread for every BLAS, and what was before afterwards."""

from __future__ import annotations

import scipy.linalg  # noqa: F401 - loads its own BLAS
from threadpoolctl import ThreadpoolController

from planner.solvers.one_thread import one_thread


def threads() -> list[int]:
    found = ThreadpoolController().select(user_api="blas").info()
    return [one["num_threads"] for one in found]


def test_one_thread_within_and_what_was_before_afterwards() -> None:
    with ThreadpoolController().limit(limits=2, user_api="blas"):
        before = threads()
        assert set(before) == {2}
        for _ in range(2):  # the second time the libraries are known
            with one_thread():
                assert set(threads()) == {1}
                with one_thread():
                    assert set(threads()) == {1}
                assert set(threads()) == {1}
            assert threads() == before
