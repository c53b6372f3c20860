"""A scenario with every number stated: names of payloads and drives that are left out are looked up, once.

    tables -> schema -> resolved -> settings and draws -> build

Whoever repeats a scenario resolves it once and changes numbers by their place; no file is read again.
"""

from dataclasses import dataclass, fields, replace

import rx90_mjcf
from ident.errors import PayloadError
from ident.naming import nearest, shown
from ident.payload import INERTIA_KEYS, Payload
from ident.payload_files import payload_from_table, payload_to_table, read_payload
from scenarios.errors import UnknownName, WrongPayload
from scenarios.files.schema import BodyTable, InertiaTable, PlantTable, Scenario
from scenarios.robots import robot
from sim.drives import DriveTruth


@dataclass(frozen=True, slots=True)
class Resolved(Scenario):
    """A scenario whose table states every number of drives and payloads."""


def resolved(scenario: Scenario) -> Resolved:
    """State every number of a scenario; one that does already is returned as it is.

    Raises:
        UnknownName: If it names a payload that does not exist.
        WrongPayload: If the believed payload is impossible.
    """
    if isinstance(scenario, Resolved):
        return scenario
    table = scenario.table
    belief = table.belief.model_copy(update={"payload": payload_to_table(believed_payload(scenario))})
    stated = table.model_copy(update={"plant": _stated_plant(table.plant, scenario.name), "belief": belief})
    return Resolved(scenario.name, scenario.folder, stated)


def believed_payload(scenario: Scenario) -> Payload:
    """The payload that identification is told.

    Raises:
        UnknownName: If it is the name of none.
        WrongPayload: If it is impossible.
    """
    belief = scenario.table.belief
    try:
        if isinstance(belief.payload, str):
            payload = _named_payload(belief.payload, scenario.name)
        else:
            payload = payload_from_table(belief.payload)
        return payload if belief.known is None else replace(payload, known=belief.known)
    except PayloadError as error:
        raise WrongPayload(f"{scenario.name}: belief.{error}") from error


def stated_table(scenario: Scenario) -> dict[str, object]:
    """The resolved scenario's tables as JSON values, for the record."""
    return resolved(scenario).table.model_dump(mode="json")


def _stated_plant(plant: PlantTable, name: str) -> PlantTable:
    nominal = robot().drives
    stated: dict[str, object] = {
        field.name: tuple(getattr(nominal, field.name).tolist())
        for field in fields(DriveTruth)
        if getattr(plant, field.name) is None
    }
    if isinstance(plant.payload, str):
        stated["payload"] = _body(_named_payload(plant.payload, name))
    return plant.model_copy(update=stated)


def _named_payload(payload: str, name: str) -> Payload:
    if payload not in rx90_mjcf.PAYLOADS:
        known = ", ".join(rx90_mjcf.PAYLOADS)
        raise UnknownName(
            f"{name}: unknown payload {shown(payload)}{nearest(payload, rx90_mjcf.PAYLOADS)}; known: {known}"
        )
    return read_payload(rx90_mjcf.PAYLOADS[payload])


def _body(payload: Payload) -> BodyTable:
    assert payload.com is not None, "the shipped payloads are complete"
    assert payload.inertia is not None, "the shipped payloads are complete"
    inertia = InertiaTable(**dict(zip(INERTIA_KEYS, payload.inertia, strict=True)))
    return BodyTable(mass=payload.mass, com=payload.com, inertia=inertia)
