"""The cases of tests that run a sample of them."""

import pytest

from tests.further import whole


def marks(*decorators):
    def test() -> None: ...

    for decorator in decorators:
        decorator(test)
    return test.pytestmark


def cases(found, names):
    return [mark.args[1] for mark in found if mark.name == "parametrize" and mark.args[0] == names]


def test_a_sample_is_completed_and_what_else_is_marked_stays():
    found = whole(
        marks(
            pytest.mark.parametrize("seed", [1]),
            pytest.mark.further("seed", [2, 3]),
            pytest.mark.parametrize("hidden", ["unit", "arm"], ids=str.upper),
            pytest.mark.charts,
        )
    )
    assert cases(found, "seed") == [[1, 2, 3]]
    assert cases(found, "hidden") == [["unit", "arm"]]
    assert {mark.name for mark in found} == {"parametrize", "charts"}


def test_further_cases_of_a_name_that_no_sample_has_are_a_mistake():
    with pytest.raises(ValueError, match="without a sample: seed"):
        whole(marks(pytest.mark.parametrize("name", ["a"]), pytest.mark.further("seed", [2])))
