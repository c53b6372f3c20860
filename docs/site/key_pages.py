"""Pages of every key of the files that users write and read, from their JSON Schemas."""

import json
import re
from typing import Any

from scenarios.experiments.scenario import load_scenario
from scenarios.results.json_schemas import FILES, RESULTS, schema

Schema = dict[str, Any]
UNIT = re.compile(r" ?(?<!`)\[([^\]`]+)\]")
"""Where a description states a unit."""
WORDS = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false", "null": ""}
BOUNDS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}
NONE = ("", [], {}, None)
PAGES = {
    "scenario": ("Scenario files", ("scenario",)),
    "robot": ("Robot files", ("robot",)),
    "payload": ("Payload and motion files", ("payload", "motion")),
    "result": ("Results", ("result", "check", "gains", "problem", "answer")),
}
LEADS = {
    "scenario": """TOML. `extends = "nominal"` overlays another scenario, built in or beside the file; a key left
out is what that one has, and the last column says what `nominal` has. Unknown keys are refused with the nearest known
one.""",
    "robot": """`robot.toml` beside a model file, URDF or MJCF. Every number says where it comes from. For a prismatic
joint read N, m and kg for N m, rad and kg m^2.""",
    "payload": "TOML. A payload is described in the frame of the last link.",
    "result": """What commands print with `--json`, one object on standard output, and the files of gains, problems and
answers.""",
}
READ = ("scenario", "robot", "payload", "motion", "gains", "problem", "answer")
"""Files that somebody writes; the others are printed."""
TITLES = {
    "scenario": "The scenario",
    "robot": "The robot",
    "payload": "A payload",
    "motion": "A motion",
    "result": "rx90 run --json, rx90 identify --json",
    "check": "rx90 check --json",
    "gains": "A gains file",
    "problem": "problem.json of a problem folder",
    "answer": "The answer of a method",
}


def heading(name: str) -> str:
    """What a schema is of; those that are not named here are of what a command prints."""
    return TITLES.get(name, f"{name} --json")


def key_pages() -> dict[str, str]:
    """The pages by their places."""
    known = {name: schema(name) for name in FILES | RESULTS}
    nominal = load_scenario("nominal").table.model_dump(mode="json")
    pages: dict[str, str] = {}
    others = tuple(name for name in known if name not in TITLES)
    for name, (title, files) in PAGES.items():
        files += others if name == "result" else ()
        sections = [_sections(file, known[file], nominal if file == "scenario" else None) for file in files]
        pages[f"reference/{name}.md"] = f"# {title}\n\n{LEADS[name]}\n\n" + "\n".join(sections)
    return pages


def _sections(name: str, schema: Schema, example: Schema | None) -> str:
    """The file's own keys, then those of every table in it, once each."""
    text = _table(name, f"## {heading(name)}", schema, schema, example)
    found, left = {schema["title"]: ""}, [(*each, example) for each in _inner(schema, "")]
    while left:
        title, path, above = left.pop(0)
        if title in found:
            continue
        found[title] = path
        table, key = schema["$defs"][title], path.rpartition(".")[2]
        values = above.get(key) if above else None
        values = values if isinstance(values, dict) and "*" not in path else None
        text += "\n" + _table(name, f"### `{_shown(path)}` {{#{_anchor(name, title)}}}", table, schema, values)
        left += [(*each, values) for each in _inner(table, f"{path}.")]
    return text


def _inner(table: Schema, before: str) -> list[tuple[str, str]]:
    """Tables within a table: their definitions and their paths."""
    found: list[tuple[str, str]] = []
    for key, value in table.get("properties", {}).items():
        named = "additionalProperties" in value or any("additionalProperties" in x for x in value.get("anyOf", []))
        path = f"{before}{key}{'.*' if named else ''}"
        found += [(title, path) for title in re.findall(r'"#/\$defs/(\w+)"', json.dumps(value))]
    return found


def _table(name: str, heading: str, table: Schema, schema: Schema, example: Schema | None) -> str:
    said = " ".join(_linked(table.get("description", "")).split())
    text = f"{heading}\n\n{said}\n\n"
    shown = example is not None
    text += f"| key | what | value | unit | default |{' `nominal` |' if shown else ''}\n"
    text += f"|---|---|---|---|---|{'---|' if shown else ''}\n"
    for key, value in table.get("properties", {}).items():
        what = value.get("description", "")
        unit = UNIT.search(what)
        what = UNIT.sub("", what, count=1).lstrip(", ")
        of = unit[1].replace("^2", "²") if unit else ""
        default = (
            ("needed" if name in READ else "always there")
            if key in table.get("required", [])
            else _value(value.get("default"))
        )
        cells = [f"`{key}`", what[:1].upper() + what[1:], _kind(name, value), of, default]
        if example is not None:
            cells.append(_value(example.get(key)) if key != "description" else "")
        text += "| " + " | ".join(map(_cell, cells)) + " |\n"
    return text


def _kind(name: str, value: Schema) -> str:
    """What may stand there, in words."""
    if "$ref" in value:
        title = value["$ref"].rpartition("/")[2]
        return f"[table](#{_anchor(name, title)})" if title != "JsonValue" else "anything"
    if "anyOf" in value:
        return " or ".join(dict.fromkeys(filter(None, (_kind(name, each) for each in value["anyOf"]))))
    if "enum" in value:
        return ", ".join(f"`{each}`" for each in value["enum"])
    if "const" in value:
        return f"`{value['const']}`"
    kind = value.get("type")
    if kind == "array":
        if "prefixItems" in value:
            return f"{len(value['prefixItems'])} of {_kind(name, value['prefixItems'][0])}"
        return f"list: {_kind(name, value.get('items', {}))}"
    if kind == "object":
        inner = value.get("additionalProperties")
        return f"by name: {_kind(name, inner)}" if isinstance(inner, dict) else "table"
    bounds = [f"{sign} {value[key]:g}" for key, sign in BOUNDS.items() if key in value]
    return " ".join([WORDS.get(kind, "anything"), ", ".join(bounds)]).strip()


def _value(value: object) -> str:
    """A default; of a table nothing, its own section has them."""
    if isinstance(value, dict) or value in NONE:
        return ""
    return f"`{json.dumps(value)}`"


def _shown(path: str) -> str:
    return f"[{path.replace('*', 'NAME')}]"


def _anchor(name: str, title: str) -> str:
    return f"{name}-{title.lower()}"


def _linked(text: str) -> str:
    return text.replace("<", "&lt;")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;") or " "
