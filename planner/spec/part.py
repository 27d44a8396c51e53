"""The base of every mapping in a spec."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class SpecPart(BaseModel):
    """Base of every mapping in a spec: unknown keys are faults, nothing changes after loading.

    Validators are built once, with the whole that is asked for: a tenth of the time of `check`.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=False, arbitrary_types_allowed=True, defer_build=True
    )
