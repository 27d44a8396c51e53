"""One thread for every BLAS, and what was before afterwards."""

from __future__ import annotations

import scipy.linalg  # noqa: F401 - loads its own BLAS
from threadpoolctl import ThreadpoolController

from planner.solvers import one_thread as module
from planner.solvers.one_thread import one_thread


def threads() -> list[int]:
    found = ThreadpoolController().select(user_api="blas").info()
    return [one["num_threads"] for one in found]


def test_one_thread_within_and_what_was_before_afterwards() -> None:
    with ThreadpoolController().limit(limits=2, user_api="blas"):
        before = threads()
        assert 2 in before  # some libraries have no second one here
        for _ in range(2):  # the second time the libraries are known
            with one_thread():
                assert set(threads()) == {1}
                with one_thread():
                    assert set(threads()) == {1}
                assert set(threads()) == {1}
            assert threads() == before


def test_libraries_are_looked_for_again_where_modules_were_loaded() -> None:
    assert module._controller(1) is module._controller(1)
    assert module._controller(1) is not module._controller(2)
