"""What identification of bare motions prints, from the little that a test is about."""

from collections.abc import Sequence

JOINT = dict.fromkeys(("ratio", "rel_std", "reason", "off", "off_std")) | {"predicted_rel_std": 0.0}
NOTHING = dict.fromkeys(("base_parameters_si", "consistent", "consistent_reason"))
LISTS = {name: [] for name in ("notes", "diagnoses", "excluded", "untold")}


def bare_document(reference: int, joints: Sequence[dict], base_parameters: Sequence[dict], **more: object) -> dict:
    """The document; each joint has a number, a name and friction."""

    def parameters(each: Sequence[dict]) -> list[dict]:
        return [{"unit": "units"} | parameter for parameter in each]

    whole = [JOINT | joint | {"friction": parameters(joint["friction"])} for joint in joints]
    document = {"reference": reference, "joints": whole, "base_parameters": parameters(base_parameters)}
    return document | NOTHING | LISTS | more
