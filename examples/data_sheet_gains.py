"""Effect of data-sheet gains: the mass that they give for a logged payload, from all joints and from each.

    python examples/data_sheet_gains.py arm.urdf bare.parquet heavy.parquet heavy.toml 12 12 10 10 10 10

As `rx90 identify --compare-with`, from Python and without the simulator.
"""

import sys
from collections.abc import Sequence

import ident
from ident.estimation.known_gains import stated_gains
from ident.parameters.weighing import outcome_of_other_gains


def main(words: Sequence[str]) -> None:
    """Print the weight and each joint's gain and mass; `words` are model, logs, payload, and a gain a joint."""
    model, bare, loaded, payload, *sheet = words
    arm = ident.load_arm(model)
    logs = [ident.read(bare), ident.read(loaded, payload=payload)]
    found = ident.identify(arm, logs)
    stated = stated_gains(arm, list(map(float, sheet)))
    believed = outcome_of_other_gains(found.prepared.problem, stated, None, found.estimate)
    weight, together = believed.weighed.payload.mass, believed.weighed.together
    print(f"payload {weight:.3f} kg; with assumed gains {together.mass:.3f} ± {2 * together.std:.3f} kg")
    gains = zip(found.joints, believed.gains.value, found.gain.tolist(), believed.weighed.joints, strict=True)
    for joint, stated, gain, alone in gains:
        said = "refused" if gain is None else f"identified {gain:.4f}, ratio {gain / stated:.3f}"
        weighs = alone.reason if alone.mass is None else f"mass from this joint {alone.mass:.3f} kg"
        print(f"{joint.joint}: assumed {stated:.4f}, {said}; {weighs}")


if __name__ == "__main__":
    main(sys.argv[1:])
