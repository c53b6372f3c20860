"""How far the moving parts of an arm stay from the floor and from the rest of the arm."""

from itertools import combinations

import mujoco
import numpy as np

from ident.arrays import Array
from sim.compile import mount_payload
from sim.drawn import full_spec
from sim.plant import PayloadBody, Plant


class Clearance:
    """Distance queries on the shapes of a model, payload included.

    Parent and child links touch by design and are not compared; neither are links that share a neighbour. What stands
    still beside the arm (floor, table) is compared with all that moves but the first link; bodies welded to a link
    count as the link. A model without shapes is far from everything.
    """

    def __init__(self, plant: Plant, margin: float) -> None:
        """Prepare the model.

        Args:
            plant: The arm; a cylinder of the payload's principal inertia stands for the payload.
            margin: Distances above it are not measured [m].
        """
        spec = full_spec(plant.robot.model, plant.robot.flange)
        spec.option.disableflags = 0
        body = mount_payload(spec, plant.payload)
        add_payload_shape(body, plant.payload)
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 1
            geom.margin = margin
        _exclude_neighbours(spec)
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


def _exclude_neighbours(spec: mujoco.MjSpec) -> None:
    """Links are numbered from the base, 0, by the joints before them; the payload comes after the last."""
    number = {"world": 0}
    for body in spec.bodies[1:]:
        number[body.name] = number[body.parent.name] + len(body.joints) + (body.name == "payload")
    beside = {name for name, k in number.items() if k == 0 and not _carries_joint(spec.body(name))}
    for (one, k), (other, m) in combinations(number.items(), 2):
        near = max(k, m) <= 1 if one in beside or other in beside else abs(k - m) <= 2
        if near and max(k, m) > 0:
            spec.add_exclude(bodyname1=one, bodyname2=other)


def _carries_joint(body: mujoco.MjsBody) -> bool:
    """Whether a body that stands still is the arm's base or below it; the world is not."""
    return body.name != "world" and bool(body.find_all(mujoco.mjtObj.mjOBJ_JOINT))


def add_payload_shape(body: mujoco.MjsBody, payload: PayloadBody) -> None:
    """Give a mounted payload the shape of the solid cylinder, axis z, that has its mass and moments."""
    ixx, iyy, izz, *_ = payload.inertia
    radius = np.sqrt(2.0 * izz / payload.mass)
    length = np.sqrt(max(6.0 * (ixx + iyy) / payload.mass - 3.0 * radius**2, 1e-4))
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, 0.5 * length, 0], pos=payload.com)
