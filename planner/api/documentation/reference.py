"""Reference pages made from the program itself, so that they cannot say what is no longer true."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.api.documentation.pages import Command

Schema = Mapping[str, Any]
_FEW = 8  # names that a table cell lists
_FIRST = "Spec"
_WORDS = {
    "string": "text or quantity",
    "number": "number",
    "integer": "whole number",
    "boolean": "true or false",
}


def _table(columns: str, rows: Sequence[Sequence[str]]) -> list[str]:
    titles = [title.strip() for title in columns.split("|")]
    lines = [f"| {' | '.join(titles)} |", f"|{'---|' * len(titles)}"]
    return [*lines, *(f"| {' | '.join(_cell(cell) for cell in row)} |" for row in rows), ""]


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


# ---------------------------------------------------------------- commands


def commands_page(commands: Sequence[Command]) -> str:
    """Every command with its arguments and options."""
    lines = ["# Commands", "", "`planner COMMAND --help` says the same on the terminal.", ""]
    for command in commands:
        said, _, examples = command.help.partition("Example: ")
        lines += [f"## {command.name}", "", *_paragraphs(said), ""]
        lines += [
            "```text",
            *(f"planner {command.name} {' '.join(command.arguments)} …".split("\n")),
            "```",
            "",
        ]
        if examples:
            lines += ["```sh no-run", *(e.strip() for e in examples.split("Example: ")), "```", ""]
        lines += _table("option | default | what it does", [(f"`{o}`", d, h) for o, d, h in command.options])
    return "\n".join(lines)


def _paragraphs(text: str) -> list[str]:
    return [line for part in text.strip().split("\n\n") for line in (" ".join(part.split()), "")]


# ---------------------------------------------------------------- spec


def spec_page() -> str:
    """Every key of a spec, from its JSON Schema."""
    from planner.spec.schema import json_schema
    from planner.spec.starter import starter_text

    schema = json_schema()
    parts = {_FIRST: {k: v for k, v in schema.items() if k != "$defs"}, **schema["$defs"]}
    lines = [
        "# Keys of a spec",
        "",
        "YAML 1.2: `no` is a text, `1e-5` a number. Quantities carry their unit in the value, `0.002 deg/s`. "
        "A key that is unknown, or given twice, is a fault. `planner schema` prints the same for editors.",
        "",
    ]
    for name, part in parts.items():
        if "properties" in part:
            lines += [f"## {name}", "", *_paragraphs(part.get("description", "")), *_keys(part)]
    return "\n".join([*lines, "## The starter spec", "", "```yaml", starter_text().rstrip(), "```", ""])


def _keys(part: Schema) -> list[str]:
    needed = part.get("required", ())
    return _table(
        "key | value | meaning",
        [
            (
                f"`{key}`" + (" (must be given)" if key in needed else ""),
                kind(value),
                str(value.get("description", "")),
            )
            for key, value in part["properties"].items()
        ],
    )


def kind(node: Schema) -> str:
    """What a value may be, in words; records are links to their section."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    for choices in (node.get("anyOf"), node.get("oneOf")):
        if choices:
            return " or ".join(dict.fromkeys(map(kind, choices)))
    if "enum" in node or "const" in node:
        names = node.get("enum", [node.get("const")])
        more = f" … ({len(names)} in all)" if len(names) > _FEW else ""
        return ", ".join(f"`{name}`" for name in names[:_FEW]) + more
    if node.get("type") == "array":
        return f"list of {kind(node.get('items', {}))}"
    if node.get("type") == "object":
        by_pattern: Schema = next(iter(node.get("patternProperties", {}).values()), {})
        inside = node.get("additionalProperties") or by_pattern
        return f"name: {kind(inside)}" if isinstance(inside, Mapping) and inside else "mapping"
    words = {
        "string": "text or quantity",
        "number": "number",
        "integer": "whole number",
        "boolean": "yes or no",
    }
    return words.get(str(node.get("type")), "value")


# ---------------------------------------------------------------- files, effects, rules


def files_page() -> str:
    """Which files there are, and where their schemas come from."""
    from planner.export.schemas import FILES

    lines = ["# Files", "", "JSON files are plain; `--json` puts the same object under `result`.", ""]
    lines += _table("file | made by | schema", [(f"`{f.name}`", f.made_by, f.schema) for f in FILES])
    return "\n".join([*lines, *_WHOSE, *_dwell_columns()])


_WHOSE = (
    "## Whose files are replaced",
    "",
    "A folder given with `-o` may hold files of others. What planner wrote there for the same spec, by its "
    "place, is replaced without a word, whatever was edited in the spec. Files of another spec, files that "
    "planner did not write and those that were edited since are refused, before anything is worked out "
    "(`planner explain P010`), unless `--force` is given. The list `.planner-files.json` in the folder knows "
    "them; without it files are known by what they say of themselves. From Python, `save` replaces what is "
    "there.",
    "",
)


def _dwell_columns() -> Iterator[str]:
    from planner.dwells.dwell_columns import COLUMNS

    yield from ["## The dwell table", "", "CSV, Parquet or HDF5; one row is one averaged record.", ""]
    rows = [(f"`{c.name}`", "" if c.kind == "text" else c.unit, c.without) for c in COLUMNS]
    yield from _table("column | unit | without it", rows)


def effects_page() -> str:
    """Every effect with equation, terms and source."""
    from planner.export.effects import effects_document

    lines = ["# Effects", "", "What a spec may declare under `effects`, and give a budget under `unit`.", ""]
    for effect in effects_document()["effects"]:
        lines += [f"## {effect['name']}", "", f"{effect['title']}: `{effect['equation']}`", ""]
        lines += [f"Source: {effect['source']}.".replace("..", "."), ""] if effect["source"] else []
        terms = [
            (f"`{t['name']}`", sensor, "".join(t["channels"]), effect["units"][sensor])
            for sensor, of_sensor in effect["terms"].items()
            for t in of_sensor
        ]
        lines += _table("term | sensor | channels | unit", terms)
        parameters = [
            (f"`{p['name']}`", p["unit"], str(p["default"]), str(p["range"])) for p in effect["parameters"]
        ]
        lines += _table("parameter | unit | default | range", parameters) if parameters else []
    return "\n".join(lines)


def rules_page() -> str:
    """Every rule that input files keep."""
    from planner.codes import rules

    lines = ["# Rules of `check`", "", "Each fault carries the code of its rule; `planner explain P111`.", ""]
    for rule in rules().values():
        lines += [
            f"## {rule.code}",
            "",
            f"**{rule.says}**",
            "",
            rule.why,
            "",
            f"What to do: {rule.remedy}",
            "",
        ]
        for word, shown in (("Wrong", rule.wrong), ("Right", rule.right)):
            if shown:
                lines += [f"{word}:", "", "```text", shown.rstrip(), "```", ""]
    return "\n".join(lines)


# ---------------------------------------------------------------- API


def api_page() -> str:
    """Every function that `import planner` offers."""
    import planner

    lines = ["# Python functions", "", *_paragraphs(inspect.getdoc(planner) or "")[:2]]
    for name in planner.__all__:
        offered = getattr(planner, name)
        if not callable(offered) or (inspect.isclass(offered) and issubclass(offered, Exception)):
            continue
        lines += [f"## {name}", "", "```text", signature(name, offered), "```", ""]
        lines += _paragraphs(inspect.getdoc(offered) or "")
    return "\n".join(lines)


def signature(name: str, function: Any) -> str:
    """`plan(spec, *, progress)`: names, and defaults where they say something."""
    shown = str(inspect.signature(function))
    shown = re.sub(r"'([\w |,.\[\]…]+)'(?=[,)\s=]|$)", r"\1", shown)
    return f"planner.{name}" + re.sub(r"<function (.+?) at [^>]*>", r"\1", shown)
