"""Draws arm.png, the picture of the README: the RX-90 bare and with its 7.025 kg payload.

Needs an off-screen OpenGL: MUJOCO_GL=egl or osmesa.
"""

from pathlib import Path

import mujoco
import numpy as np
from matplotlib.image import imsave

import rx90_mjcf
from ident.payload.files import read_payload
from sim.clearance import add_payload_shape
from sim.compile import mount_payload
from sim.plant import PayloadBody

POSES = np.array([[0.1, 0.3, 1.1, 0.3, 0.8, 0.0], [-0.1, 0.45, 1.1, 0.3, 0.7, 0.0]])
WIDTH, HEIGHT = 700, 760


def picture(pose: np.ndarray, payload: PayloadBody | None) -> np.ndarray:
    spec = mujoco.MjSpec.from_file(str(rx90_mjcf.MJCF))
    body = mount_payload(spec, payload)
    if payload is not None:
        add_payload_shape(body, payload)
        body.geoms[-1].material = "steel"
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, HEIGHT, WIDTH) as renderer:
        renderer.update_scene(data, camera="side")
        return renderer.render().copy()


if __name__ == "__main__":
    weighed = read_payload(rx90_mjcf.PAYLOADS["7.025 kg"])
    assert weighed.com is not None
    assert weighed.inertia is not None
    cylinder = PayloadBody(mass=weighed.mass, com=weighed.com, inertia=weighed.inertia)
    imsave(Path(__file__).parent / "arm.png", np.hstack([picture(POSES[0], None), picture(POSES[1], cylinder)]))
