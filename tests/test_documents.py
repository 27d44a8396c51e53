"""What stands in a file and not in its schema, and the other way round, is seen by the tests' own check."""

import jsonschema
import pytest

from tests.documents import keeps

SPEC = {"name": "a", "sha256": "0"}
WHOLE = {"planner": "1", "spec": SPEC, "rates": {"good_rejected": 0.05, "bad_accepted": 0.05}, "checks": []}


@pytest.mark.parametrize(
    "document",
    [
        WHOLE,
        WHOLE | {"notes": [], "more": 1},
        WHOLE | {"notes": [], "spec": SPEC | {"more": 1}},
        WHOLE | {"notes": [1]},
    ],
    ids=["lacks one", "one more", "one more within", "of another kind"],
)
def test_a_document_with_other_keys_is_not_kept(document):
    keeps(WHOLE | {"notes": []}, "check-plan")
    with pytest.raises(jsonschema.ValidationError):
        keeps(document, "check-plan")
