"""How far the moving parts of an arm stay from the floor and from the rest of the arm."""

import mujoco
import numpy as np

from ident.arrays import Array
from sim.compile import mount_payload
from sim.plant import PayloadBody, Plant


class Clearance:
    """Distance queries on the shapes of a model, payload included.

    Parent and child links touch by design and are not compared; neither are links that share a neighbour.
    """

    def __init__(self, plant: Plant, margin: float) -> None:
        """Prepare the model.

        Args:
            plant: The arm; a cylinder of the payload's principal inertia stands for the payload.
            margin: Distances above it are not measured [m].
        """
        spec = mujoco.MjSpec.from_file(str(plant.robot.model))
        spec.option.disableflags = 0
        body = mount_payload(spec, plant.payload)
        add_payload_shape(body, plant.payload)
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 1
            geom.margin = margin
        chain = ["base", *(joint.parent.name for joint in spec.joints), "payload"]
        for i, name in enumerate(chain):
            for other in chain[i + 1 : i + 3]:
                spec.add_exclude(bodyname1=name, bodyname2=other)
        self._margin = margin
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)

    def __call__(self, q: Array) -> Array:
        """Smallest distance at each position, `margin` where everything is farther [m].

        Args:
            q: Joint positions [rad], shape (N, n).

        Returns:
            Distances, negative for overlaps, shape (N,).
        """
        out = np.full(len(q), self._margin)
        for k, position in enumerate(q):
            self._data.qpos[:] = position
            mujoco.mj_kinematics(self._model, self._data)
            mujoco.mj_comPos(self._model, self._data)
            mujoco.mj_collision(self._model, self._data)
            if self._data.ncon:
                out[k] = min(self._margin, self._data.contact.dist.min())
        return out


def add_payload_shape(body: mujoco.MjsBody, payload: PayloadBody) -> None:
    """Give a mounted payload the shape of the solid cylinder, axis z, that has its mass and moments."""
    ixx, iyy, izz, *_ = payload.inertia
    radius = np.sqrt(2.0 * izz / payload.mass)
    length = np.sqrt(max(6.0 * (ixx + iyy) / payload.mass - 3.0 * radius**2, 1e-4))
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, 0.5 * length, 0], pos=payload.com)
