"""The rules that refuse a gain, or the ratio of two: a deviation beyond the one that was allowed."""


def refusal(predicted_rel_std: float, load_rms: float, max_rel_std: float, unit: str) -> str | None:
    """Why a gain is refused, None if it is not.

    Args:
        predicted_rel_std: Relative standard deviation to expect.
        load_rms: Root mean square of the payload's torque or force on the joint.
        max_rel_std: Largest one that is allowed.
        unit: Of `load_rms`.
    """
    if predicted_rel_std <= max_rel_std:
        return None
    load = (
        f"the payload puts {load_rms:.3g} {unit} rms on this joint" if load_rms > 0.0 else "no payload loads this joint"
    )
    most = _percent(max_rel_std)
    return f"predicted standard deviation {_percent(predicted_rel_std)} of the gain exceeds {most}; {load}"


def ratio_refusal(rel_std: float, max_rel_std: float, reference: int) -> str | None:
    """Why the ratio of a gain to that of another joint is refused, None if it is not.

    Args:
        rel_std: Relative standard deviation of the ratio, inf where nothing ties the two.
        max_rel_std: Largest one that is allowed.
        reference: The other joint, from 0.
    """
    if rel_std <= max_rel_std:
        return None
    tied = f"these motions hardly excite the links that it shares with joint {reference + 1}"
    return f"standard deviation {_percent(rel_std)} of the ratio exceeds {_percent(max_rel_std)}; {tied}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
