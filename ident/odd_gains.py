"""Gains that are found well and yet look odd: a negative one, and one that is far from its neighbours."""

import numpy as np

from ident.estimate import GainEstimate, IdentifiedGain

FAR = 100.0
"""Factor from the median of the other gains from which a unit is suspected; joints of one arm differ by 30."""


def odd_gain_notes(estimate: GainEstimate) -> tuple[str, ...]:
    """A note on every negative gain, and on every one that is a hundredth or a hundred times the others' median."""
    found = {j: each.value for j, each in enumerate(estimate.joints) if isinstance(each, IdentifiedGain)}
    return (*sign_notes(found), *size_notes(found))


def sign_notes(gains: dict[int, float]) -> tuple[str, ...]:
    """Notes on negative gains, by joint from 0."""
    return tuple(
        f"joint {j + 1}: identified, but negative: v{j + 1} counts against q{j + 1} in every log; legal for a motor "
        f"mounted the other way, else negate v{j + 1} or q{j + 1}, whichever is against the model"
        for j, gain in gains.items()
        if gain < 0.0
    )


def size_notes(gains: dict[int, float]) -> tuple[str, ...]:
    """Notes on gains far from the others, by joint from 0; of one gain there is nothing to say."""
    notes: list[str] = []
    for j, gain in gains.items():
        others = [abs(each) for k, each in gains.items() if k != j]
        ratio = abs(gain) / float(np.median(others)) if others else 1.0
        if not 1.0 / FAR < ratio < FAR:
            notes.append(
                f"joint {j + 1}: the gain is {ratio:.2g} times the median of the others; is v{j + 1} in another unit "
                "than their currents?"
            )
    return tuple(notes)
