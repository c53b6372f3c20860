"""Where tendons that an effect added one after another stand in a compiled model."""

import mujoco


def tendons_ending(model: mujoco.MjModel, ending: str) -> slice:
    """Those whose names end in `ending`; empty if there are none."""
    found = [k for k in range(model.ntendon) if model.tendon(k).name.endswith(ending)]
    return slice(found[0], found[-1] + 1) if found else slice(0)
