"""Resolution of a scenario: names of payloads and omitted drives are replaced by their numbers, once.

    tables -> schema -> resolved -> settings and draws -> build

`load_scenario` resolves. Repetitions change numbers by their key path, and no file is read again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

import rx90_mjcf
from ident.payload.payload import INERTIA_KEYS, Payload, payload_from_table, payload_to_table, read_payload
from ident.support.errors import PayloadError
from ident.support.naming import nearest, shown
from scenarios.experiments.files.exactness import is_exact
from scenarios.experiments.files.mountings import LOADED, by_mounting, mountings
from scenarios.experiments.files.schema import BeliefTable, BodyTable, InertiaTable, Scenario
from scenarios.experiments.robots import robot_of
from scenarios.support.errors import ScenarioError, UnknownName
from sim.robot import DriveTruth

NOTHING = (0.0, 0.0, 0.0)


def resolved(scenario: Scenario) -> Scenario:
    """Return a scenario with all numbers filled in.

    Raises:
        UnknownName: If its robot or payload does not exist.
        RobotError: If the robot's file cannot be read.
        ScenarioError: If the assumed payload is impossible.
    """
    table, name = scenario.table, scenario.name
    believed = {key: payload_to_table(payload) for key, payload in believed_payloads(scenario).items()}
    true = {key: _body(body, name) for key, body in by_mounting(table.plant.payload, table.plant.payloads).items()}
    plant, belief = (_mounted(payloads, table.experiment.protocol) for payloads in (true, believed))
    update: dict[str, object] = {
        "plant": table.plant.model_copy(update={**_nominal_drives(scenario), **plant}),
        "belief": table.belief.model_copy(update={**belief, "exact": False}),  # a specified value is replaced by zero
    }
    if table.cost is not None:
        update["cost"] = table.cost.model_copy(update={"payload": _body(table.cost.payload, name)})
    return replace(scenario, table=table.model_copy(update=update))


def believed_payloads(scenario: Scenario) -> dict[str, Payload]:
    """Return the assumed payloads, by mounting; without standard deviations if taken as exact.

    Raises:
        UnknownName: If a name does not exist.
        ScenarioError: If a payload is impossible.
    """
    exact, certain = scenario.table.belief.exact, {"mass_std": 0.0, "com_std": NOTHING, "inertia_std": 2 * NOTHING}
    return {
        key: replace(payload, **certain) if is_exact(exact, key) else payload
        for key, payload in stated_payloads(scenario).items()
    }


def stated_payloads(scenario: Scenario) -> dict[str, Payload]:
    """Return the assumed payloads with specified standard deviations, by mounting; raises as `believed_payloads`."""
    belief = scenario.table.belief
    return {
        key: _stated(key, payload, belief, scenario.name)
        for key, payload in by_mounting(belief.payload, belief.payloads).items()
    }


def _stated(key: str, stated: str | Mapping[str, object], belief: BeliefTable, name: str) -> Payload:
    known = belief.known
    try:
        payload = _named_payload(stated, name) if isinstance(stated, str) else payload_from_table(stated)
        use = known.get(key) if isinstance(known, Mapping) else known
        return payload if use is None else replace(payload, known=use)
    except PayloadError as error:
        where = "" if key == LOADED else f"payloads.{key}: "
        raise ScenarioError(f"{name}: belief.{where}{error}") from error


def _mounted(payloads: Mapping[str, object], protocol: Sequence[str]) -> dict[str, object]:
    """Return the fields of a table with the payloads that a protocol mounts; with all if it mounts none.

    A payload that is never mounted is removed, so that a draw of it is an error.
    """
    names = mountings(protocol) or tuple(payloads)
    return {
        "payload": payloads.get(LOADED) if LOADED in names else None,
        "payloads": {name: payloads[name] for name in names if name != LOADED},
    }


def _nominal_drives(scenario: Scenario) -> dict[str, object]:
    """Return the values of drives that are not specified, by field."""
    plant, nominal = scenario.table.plant, robot_of(scenario).drives
    return {
        field.name: tuple(getattr(nominal, field.name).tolist())
        for field in fields(DriveTruth)
        if getattr(plant, field.name) is None
    }


def _named_payload(payload: str, name: str) -> Payload:
    if payload not in rx90_mjcf.PAYLOADS:
        known = ", ".join(rx90_mjcf.PAYLOADS)
        raise UnknownName(
            f"{name}: unknown payload {shown(payload)}{nearest(payload, rx90_mjcf.PAYLOADS)}; known: {known}"
        )
    return read_payload(rx90_mjcf.PAYLOADS[payload])


def _body(body: str | BodyTable, name: str) -> BodyTable:
    if not isinstance(body, str):
        return body
    payload = _named_payload(body, name)
    assert payload.com is not None, "the shipped payloads are complete"
    assert payload.inertia is not None, "the shipped payloads are complete"
    inertia = InertiaTable(**dict(zip(INERTIA_KEYS, payload.inertia, strict=True)))
    return BodyTable(mass=payload.mass, com=payload.com, inertia=inertia)
