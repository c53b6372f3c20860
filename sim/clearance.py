"""Distances of the moving parts of an arm from the floor and from the other parts of the arm."""

from collections.abc import Sequence
from itertools import pairwise

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.compile import mount_payload
from sim.errors import ModelFileError
from sim.model_spec import compiler_reason, full_spec, silenced
from sim.plant import Plant
from sim.shapes import PLANE, Solid, add_payload_shape, add_solid, stand_in

CLEARANCE = 0.03
"""Required distance from the floor and within the arm [m]."""
POSES = 100
"""Number of random positions; two shapes that are nearer than that at all of them are not compared."""


class Clearance:
    """Distances between the shapes of a model, including the payload, or between capsules if the arm has no shapes.

    Links that are adjacent or have a common neighbour are not compared. Static bodies belong to the base, except planes
    and bodies that are separate from the arm (a table): these are compared with all links but the first, which is
    mounted on them. Pairs of links, or of a link and the payload, that are nearer than `CLEARANCE` at all joint
    positions are not compared either.

    Attributes:
        always_near: Names of these bodies, in pairs.
    """

    @silenced()
    def __init__(self, plant: Plant, margin: float, solids: Sequence[Solid] | None = None) -> None:
        """Prepare the model.

        Args:
            plant: The arm and its payload.
            margin: Largest distance that is computed [m].
            solids: Shapes of the payload; None for a cylinder with its principal moments of inertia.

        Raises:
            ModelFileError: If its model file cannot be compiled with its shapes.
        """
        spec = full_spec(plant.robot.model, plant.robot.flange)
        spec.option.disableflags = 0
        _set_planes_apart(spec)
        neighbours = list(pairwise(stand_in(spec, plant.robot)))
        groups = _groups(spec)
        body = mount_payload(spec, plant.payload)
        if solids is None:
            add_payload_shape(body, plant.payload)
        for solid in solids or ():
            add_solid(body, solid)
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 1
            geom.margin = margin
        chain = [*groups, [body.name]]
        for i, names in enumerate(chain):
            neighbours += [(one, other) for close in chain[i + 1 : i + 3] for one in names for other in close]
        neighbours += [(one, other) for one in (*_beside(spec), *_planes(spec)) for other in groups[1]]
        for one, other in dict.fromkeys(neighbours):
            spec.add_exclude(bodyname1=one, bodyname2=other)
        self._margin = margin
        try:
            self._model = spec.compile()
            arm, moving = ({name for names in some for name in names} for some in (groups, groups[1:]))
            self.always_near = self._near_everywhere(arm, {body.name, *moving})
            if self.always_near:
                for one, other in self.always_near:
                    spec.add_exclude(bodyname1=one, bodyname2=other)
                self._model = spec.compile()
        except ValueError as error:
            raise ModelFileError(f"robot model {plant.robot.model}: {compiler_reason(error)}") from error
        self._data = mujoco.MjData(self._model)

    def __call__(self, q: Array) -> Array:
        """Return the smallest distance at each position, `margin` if all distances are larger [m].

        Negative distances are overlaps. q are joint positions [rad], shape (N, n).
        """
        out = np.full(len(q), self._margin)
        for k, position in enumerate(q):
            contact = self._contacts(position, self._data)
            if len(contact.dist):
                out[k] = min(self._margin, contact.dist.min())
        return out

    def nearest(self, q: Array) -> tuple[str, str] | None:
        """Return the names of the two nearest bodies at a position (n,), None if all distances exceed the margin."""
        contact = self._contacts(q, self._data)
        return self._pairs(contact.geom[[int(contact.dist.argmin())]]).pop() if len(contact.dist) else None

    def _near_everywhere(self, *among: set[str]) -> tuple[tuple[str, str], ...]:
        """Return pairs of bodies within one of these sets that are too near at all of some random positions."""
        model, data = self._model, mujoco.MjData(self._model)
        lower, upper = np.where(model.jnt_limited[:, None], model.jnt_range, (-np.pi, np.pi)).T
        found: set[tuple[str, str]] | None = None
        for q in np.random.default_rng(0).uniform(lower, upper, (POSES, model.njnt)):
            contact = self._contacts(q, data)
            near = self._pairs(contact.geom[contact.dist < CLEARANCE])
            found = near if found is None else found & near
            if not found:
                break
        return tuple(sorted(pair for pair in found or () if any(names >= {*pair} for names in among)))

    def _contacts(self, q: Array, data: mujoco.MjData) -> mujoco.MjContact:
        data.qpos[:] = q
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_comPos(self._model, data)
        mujoco.mj_collision(self._model, data)
        return data.contact

    def _pairs(self, geoms: Array) -> set[tuple[str, str]]:
        """Names of the bodies of pairs of shapes (k, 2), each pair in alphabetical order."""
        bodies = self._model.geom_bodyid[geoms]
        names = [sorted(self._model.body(int(body)).name for body in pair) for pair in bodies]
        return {(one, other) for one, other in names}


def _set_planes_apart(spec: mujoco.MjSpec) -> None:
    """Move planes of the world to separate bodies, as distances to the base (or world) are not computed."""
    planes = [geom for geom in spec.geoms if geom.type == PLANE and geom.parent.name == "world"]
    if not planes:
        return
    model = spec.compile()
    for k, geom in enumerate(planes):
        pos, quat, size = model.geom_pos[geom.id], model.geom_quat[geom.id], model.geom_size[geom.id]
        apart = spec.worldbody.add_body(name=f"plane {k}", pos=pos, quat=quat)
        apart.add_geom(type=PLANE, size=size)
        spec.delete(geom)


def _groups(spec: mujoco.MjSpec) -> list[list[str]]:
    """Return names of bodies that move together: the static base, then each link with bodies fixed to it."""
    links = [joint.parent for joint in spec.joints]
    below = [{link.name, *_below(link)} for link in links] + [set[str]()]
    moving = [sorted(mine - farther) for mine, farther in pairwise(below)]
    planes = _planes(spec)
    base = sorted({body.name for body in spec.bodies} - below[0] - planes - set(_beside(spec)))
    return [base, *moving]


def _beside(spec: mujoco.MjSpec) -> list[str]:
    """Return names of static bodies that carry no joint, without planes."""
    moving = {name for joint in spec.joints for name in (joint.parent.name, *_below(joint.parent))}
    planes = _planes(spec)
    still = [body for body in spec.bodies[1:] if body.name not in moving | planes]
    return [body.name for body in still if not body.find_all(mujoco.mjtObj.mjOBJ_JOINT) and body.name != "payload"]


def _planes(spec: mujoco.MjSpec) -> set[str]:
    """Names of the bodies of planes."""
    return {geom.parent.name for geom in spec.geoms if geom.type == PLANE}


def _below(body: mujoco.MjsBody) -> list[str]:
    return [each.name for each in body.find_all("body")]
