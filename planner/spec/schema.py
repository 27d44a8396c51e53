"""JSON Schema of a spec (draft 2020-12), for editors: keys, units, and the names that there are."""

from __future__ import annotations

from typing import Any

from planner import catalog
from planner.protocols import SENSORS
from planner.spec.forms import NAME_PATTERN
from planner.spec.model import Spec
from planner.spec.rules_requirement import all_errors

CURVE_PATTERN = "curve_(gyro|acc)_[xyz]_over_[a-z_]+(_at_[m0-9p_]+)?"  # planner.effects._measured_curve
Schema = dict[str, Any]

# pydantic writes the limits of a field that reads text first in its own words
_KEYWORDS = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}


def json_schema() -> Schema:
    """The schema with today's effects, errors, benches and trajectories enumerated.

    It knows what one field can tell; `planner.spec.rules` knows more. A file that it refuses is refused by
    `planner check` as well.
    """
    schema: Schema = tidy(Spec.model_json_schema())
    _name_requirement(schema)
    _name_keys(schema)
    _name_effects(schema)
    _name_errors(schema)
    _name_plugins(schema)
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "planner spec",
        "description": "What a navigation must achieve, what the sensors and benches are like, how to plan.",
    }
    return headed(schema, head)


def headed(schema: Schema, head: Schema) -> Schema:
    """A schema that says these keys last, in place of its own."""
    return {key: value for key, value in schema.items() if key not in head} | head


def tidy(node: Any) -> Any:
    """Without what is no use to an editor: generated titles, defaults in SI, and null."""
    if isinstance(node, list):
        return [tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    choices = [one for one in node.get("anyOf", ()) if one != {"type": "null"}]
    if "anyOf" in node and len(choices) == 1:
        rest = {key: value for key, value in node.items() if key != "anyOf"}
        return tidy({**choices[0], **rest})
    dropped = {"default", "discriminator"} | ({"title"} if isinstance(node.get("title"), str) else set())
    result = {_KEYWORDS.get(key, key): tidy(value) for key, value in node.items() if key not in dropped}
    if "patternProperties" in node:
        result["additionalProperties"] = False
    if "properties" in node:  # whose keys are names, not keywords
        result["properties"] = {key: tidy(value) for key, value in node["properties"].items()}
    return result


def _property(schema: Schema, owner: str, name: str) -> Schema:
    where = schema if owner == "Spec" else schema["$defs"][owner]
    field: Schema = where["properties"][name]
    return field


def _name_requirement(schema: Schema) -> None:
    """One requirement may stand without the brackets of a list."""
    field = _property(schema, "Spec", "requirement")
    description = field.pop("description")
    several = dict(field)
    field.clear()
    field.update({"description": description, "oneOf": [{"$ref": "#/$defs/Requirement"}, several]})


def _name_keys(schema: Schema) -> None:
    """JSON knows only text as a key; the numbers of axes are digits there."""
    _property(schema, "BenchLimits", "travel")["propertyNames"] = {"pattern": "^[1-6]$"}
    for name in ("benches", "tests"):
        _property(schema, "Spec", name)["propertyNames"] = {"pattern": NAME_PATTERN}


def _name_effects(schema: Schema) -> None:
    known = catalog.effects()
    effects = _property(schema, "Spec", "effects")
    effects["items"] = _or_curve(list(known))
    effects["uniqueItems"] = True
    for sensor in SENSORS:
        here = [name for name, effect in known.items() if sensor in effect.sensors]
        _property(schema, "Unit", sensor)["propertyNames"] = _or_curve(here)


def _name_errors(schema: Schema) -> None:
    names = {"enum": all_errors()}
    _property(schema, "Given", "given")["propertyNames"] = names
    calibrates = _property(schema, "Test", "calibrates")
    description = calibrates["description"]
    calibrates.clear()
    calibrates["description"] = description
    for key, ways in (("bench", 1), ("record", 2), ("motions", 2)):
        one = _property(schema, "Test", key)
        said = {k: one.pop(k) for k in ("description", "default") if k in one}
        single = dict(one)
        one.clear()
        choice = {"type": "array", "items": single, "minItems": ways, "description": "a choice"}
        one.update(said | {"anyOf": [single, choice]})
    names = _or_curve(all_errors(), "(gyro|accelerometer)\\.")
    calibrates["oneOf"] = [names, {"type": "array", "items": names, "uniqueItems": True}]


def _or_curve(names: list[str], before: str = "") -> Schema:
    """Names that are in the catalogue, or that describe a measured curve."""
    return {"anyOf": [{"enum": names}, {"type": "string", "pattern": f"^{before}{CURVE_PATTERN}$"}]}


def _name_plugins(schema: Schema) -> None:
    families = list(catalog.trajectories())
    flight = _property(schema, "Spec", "trajectory")
    description = flight["description"]
    flight.clear()
    flight["description"] = description
    flight["oneOf"] = [
        {"enum": families},
        {
            "type": "object",
            "properties": {
                "name": {"enum": families, "description": "a built-in flight; its settings stand beside"},
                "file": {"type": "string", "description": "a CSV file beside the spec"},
            },
            "anyOf": [{"required": ["name"]}, {"required": ["file"]}],
        },
    ]
    kinds = list(catalog.benches())
    if kinds:
        _property(schema, "Bench", "kind")["enum"] = kinds
