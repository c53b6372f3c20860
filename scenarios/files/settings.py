"""Settings: values of a scenario by their place in it, `plant.payload.mass` = 7.0."""

from collections.abc import Mapping
from dataclasses import fields

from ident.payload_files import payload_to_table
from scenarios.build import believed_payload, true_plant
from scenarios.errors import ScenarioError
from scenarios.files.schema import Scenario, scenario_from_table
from scenarios.files.tables import nearest
from scenarios.robots import robot
from sim.drives import DriveTruth

Value = float | str | list[float]
"""What a place in a scenario can hold: a number, a name, one number a joint or axis."""


def explicit_table(scenario: Scenario) -> dict[str, object]:
    """The scenario's tables with every number stated: names of payloads and drives left out are resolved.

    Raises:
        ScenarioError: If it names a payload that does not exist.
    """
    table = scenario.table.model_dump(mode="json")
    nominal, plant = robot().drives, table["plant"]
    for field in fields(DriveTruth):
        if plant[field.name] is None:
            plant[field.name] = getattr(nominal, field.name).tolist()
    if plant["errors"]["joint_compliance"] is None:
        plant["errors"]["joint_compliance"] = [0.0] * len(nominal.gain)
    body = true_plant(scenario).payload
    inertia = dict(zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), body.inertia, strict=True))
    plant["payload"] = {"mass": body.mass, "com": list(body.com), "inertia": inertia}
    table["belief"]["payload"] = payload_to_table(believed_payload(scenario))
    return table


def value_at(table: Mapping[str, object], place: str) -> Value:
    """What stands at a place of an explicit table.

    Raises:
        ScenarioError: If there is no such place, or it holds a table.
    """
    inner: object = table
    for depth, key in enumerate(keys := place.split(".")):
        if not isinstance(inner, Mapping) or key not in inner:
            known = [str(k) for k in inner] if isinstance(inner, Mapping) else []
            at = ".".join(keys[:depth]) or "the scenario"
            raise ScenarioError(f"no {key!r} in {at}{nearest(key, known)}; known: {', '.join(known) or 'nothing'}")
        inner = inner[key]
    if isinstance(inner, list) and all(isinstance(x, float | int) and not isinstance(x, bool) for x in inner):
        return [float(x) for x in inner]
    if isinstance(inner, str):
        return inner
    if isinstance(inner, float | int) and not isinstance(inner, bool):
        return float(inner)
    kind = "a table" if isinstance(inner, Mapping) else f"{inner!r}"
    raise ScenarioError(f"{place} holds {kind}; expected a number, an array of numbers or a name")


def with_settings(scenario: Scenario, settings: Mapping[str, Value]) -> Scenario:
    """The scenario with other values at some places, and nothing random left.

    Raises:
        ScenarioError: If a place does not exist or does not take the value.
    """
    table = explicit_table(scenario)
    for place, value in settings.items():
        value_at(table, place)
        *above, last = place.split(".")
        inner: dict[str, object] = table
        for key in above:
            inner = inner[key]  # pyright: ignore[reportAssignmentType]  (value_at has walked the same tables)
        inner[last] = value
    table["random"] = {}
    return scenario_from_table(table, scenario.name, scenario.folder, scenario.name)
