"""What a verb may be given for a spec: a file's name, a mapping, YAML bytes read elsewhere, or one loaded."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from planner.errors import InputError

if TYPE_CHECKING:
    from planner.spec.load import LoadedSpec

SpecLike: TypeAlias = "LoadedSpec | str | Path | Mapping[str, Any]"
WRITTEN_HERE = Path("<spec>")  # a spec that was built in Python; its folder is the current one
STDIN = "-"


def read(spec: SpecLike) -> LoadedSpec:
    """The spec, whole or of the sensor alone.

    Raises InputError with every fault of the parts that are there.
    """
    from planner.spec.load import LoadedSpec
    from planner.spec.sensor_alone import sensor_spec_from_bytes

    return spec if isinstance(spec, LoadedSpec) else sensor_spec_from_bytes(*text_of(spec))


def text_of(spec: str | Path | Mapping[str, Any]) -> tuple[bytes, Path]:
    """The bytes of a spec and the file that its faults name. Raises InputError when they cannot be had."""
    from planner.spec.load import spec_bytes

    if isinstance(spec, Mapping):
        return yaml_of(spec), WRITTEN_HERE
    if str(spec) == STDIN:
        return standard_input(), Path("<stdin>")
    return spec_bytes(Path(spec)), Path(spec)


def whole(spec: SpecLike) -> LoadedSpec:
    """The whole spec. Raises InputError with every fault, and for what a spec of the sensor alone lacks."""
    from planner.spec.load import load_spec, spec_from_bytes

    if isinstance(spec, (str, Path)) and str(spec) != STDIN:
        return load_spec(Path(spec))
    found = read(spec)
    return spec_from_bytes(found.data, found.path) if found.absent else found


def standard_input() -> bytes:
    """What stands on standard input, as much of it as a spec may be, and a byte more."""
    import sys

    from planner.spec.yaml12 import MAX_BYTES

    return sys.stdin.buffer.read(MAX_BYTES + 1)


def yaml_of(tree: Mapping[str, Any]) -> bytes:
    """A spec built in Python as the YAML that says the same: tuples are lists, paths are text.

    Raises InputError for a value that YAML cannot say.
    """
    import yaml

    from planner.verify.vary import yaml_text

    try:
        return yaml_text(_plain(tree)).encode()
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError(f"a spec holds text, numbers, lists and mappings alone: {error}") from None


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value
