"""Shapes that a model file does not have, and distances of the moving parts of an arm.

Added are the flange's face, the payload, and capsules for an arm without shapes. A capsule from the joint of link j to
the next joint represents the link. Its radius is `RADIUS_SHARE` times its length, and at least `LEAST_RADIUS` times the
reach of the arm. A link of zero length, as in a wrist with intersecting axes, has no capsule. The last link ends at the
flange, if the model states one. The floor is the plane z = 0 if the first joint is above it.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.model_spec import compiled, full_spec, silenced
from sim.plant import PayloadBody, Plant, mount_payload
from sim.robot import Robot

NAMES = ("flange", "attachment_site", "attachment", "tool0", "ee_link")
"""Names of sites and bodies at a flange; the first one found is used."""
RADIUS_SHARE = 0.12
"""Radius of a capsule, as a share of the link's length."""
LEAST_RADIUS = 0.03
"""Least radius, as a share of the reach: the sum of all lengths."""
NEARLY_ALL = 90
"""Number of 100 random positions at which two bodies are too near because of their shapes, such as convex hulls."""
CLEARANCE = 0.03
"""Required distance from the floor and within the arm [m]."""
FLOOR = "capsule_floor"
PLANE, CAPSULE = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_CAPSULE
CYLINDER, BOX = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_BOX


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flange:
    """A flange's face: the mounting face of payloads."""

    origin: Array  # its centre in the frame of the last link [m], shape (3,), from the last joint
    rotation: Array  # rotation matrix from its axes to those of the last link, (3, 3); z points away from the arm
    name: str  # name of the site or body that defines the flange; empty if the last joint's axis is used


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solid:
    """A box or a cylinder of a payload."""

    cylinder: bool  # whether it is a cylinder about its z axis, otherwise a box
    size: tuple[float, ...]  # radius and half length of a cylinder, half edges of a box [m]
    center: Array  # from the last joint in the axes of the last link [m], shape (3,)
    rotation: Array  # rotation matrix from the shape's axes to those of the last link, shape (3, 3)


@silenced()
def flange_of(robot: Robot) -> Flange:
    """The flange of an arm; raises `PlantError` if its model file cannot be compiled."""
    with compiled(robot.model):
        model = full_spec(robot.model, robot.flange).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    last = int(model.jnt_bodyid[-1])
    R, p = data.xmat[last].reshape(3, 3), data.xanchor[-1]
    for name in NAMES:
        for kind, places, turns, bodies in (
            (mujoco.mjtObj.mjOBJ_SITE, data.site_xpos, data.site_xmat, model.site_bodyid),
            (mujoco.mjtObj.mjOBJ_BODY, data.xpos, data.xmat, np.arange(model.nbody)),
        ):
            k = mujoco.mj_name2id(model, kind, name)
            if k >= 0 and model.body_weldid[bodies[k]] == model.body_weldid[last]:
                return Flange(origin=R.T @ (places[k] - p), rotation=R.T @ turns[k].reshape(3, 3), name=name)
    quat, along_axis = np.empty(4), np.empty(9)  # the smallest rotation that maps z to the axis
    mujoco.mju_quatZ2Vec(quat, model.jnt_axis[-1] / np.linalg.norm(model.jnt_axis[-1]))
    mujoco.mju_quat2Mat(along_axis, quat)
    return Flange(origin=np.zeros(3), rotation=along_axis.reshape(3, 3), name="")


def add_solid(body: mujoco.MjsBody, solid: Solid) -> None:
    """Give a mounted payload a shape."""
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(solid.rotation).ravel())
    kind, size = CYLINDER if solid.cylinder else BOX, [*solid.size, 0.0][:3]
    body.add_geom(type=kind, size=size, pos=solid.center, quat=quat, mass=0.0)


def add_payload_shape(body: mujoco.MjsBody, payload: PayloadBody) -> None:
    """Set the shape of a mounted payload to the solid cylinder with axis z that has its mass and moments."""
    ixx, iyy, izz, *_ = payload.inertia
    radius = np.sqrt(2.0 * izz / payload.mass)
    length = np.sqrt(max(6.0 * (ixx + iyy) / payload.mass - 3.0 * radius**2, 1e-4))
    body.add_geom(type=CYLINDER, size=[radius, 0.5 * length, 0], pos=payload.com)


def stand_in(spec: mujoco.MjSpec, robot: Robot) -> list[str]:
    """Name all bodies; give an arm without shapes capsules and a floor; return names of bodies with a capsule."""
    for k, body in enumerate(spec.bodies):
        if not body.name:
            body.name = f"unnamed_body_{k}"
    moving = {body.name for joint in spec.joints for body in (joint.parent, *joint.parent.find_all("body"))}
    if any(geom.parent.name in moving for geom in spec.geoms):
        return []
    flange = flange_of(robot)
    return add_capsules(spec, flange.origin if flange.name else None)


def add_capsules(spec: mujoco.MjSpec, flange: Array | None) -> list[str]:
    """Add capsules to an arm whose bodies have names, and a floor if it is above the plane z = 0 and has none.

    The last one ends at the centre of a flange in the frame of the last link [m], if given. Return the bodies' names.
    """
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [int(body) for body in model.jnt_bodyid]
    ends = [*data.xanchor]
    if flange is not None:
        ends.append(ends[-1] + data.xmat[bodies[-1]].reshape(3, 3) @ flange)
    lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise(ends)]
    thinnest = LEAST_RADIUS * sum(lengths)
    names: list[str] = []
    for body, length, *line in zip(bodies, lengths, ends[:-1], ends[1:], strict=False):
        if length <= thinnest:
            continue
        R = data.xmat[body].reshape(3, 3)
        fromto = np.concatenate([R.T @ (end - data.xpos[body]) for end in line])
        names.append(model.body(body).name)
        radius = max(RADIUS_SHARE * length, thinnest)
        spec.body(names[-1]).add_geom(type=CAPSULE, fromto=fromto, size=[radius, 0.0, 0.0], mass=0.0)
    if float(ends[0][2]) > thinnest and not any(geom.type == PLANE for geom in spec.geoms):
        floor = spec.worldbody.add_body(name=FLOOR)
        floor.add_geom(type=PLANE, size=[3.0, 3.0, 0.1])
    return names


class Clearance:
    """Distances between the shapes of a model, including the payload, or between capsules if the arm has no shapes.

    Links that are adjacent or have a common neighbour are not compared. Static bodies belong to the base, except planes
    and bodies that are separate from the arm (a table): these are compared with all links but the first, which is
    mounted on them. Pairs of links, or of a link and the payload, that are nearer than `CLEARANCE` at nearly all joint
    positions are not compared either.

    Attributes:
        always_near: Names of these bodies, in pairs.
    """

    @silenced()
    def __init__(self, plant: Plant, margin: float, solids: Sequence[Solid] | None = None) -> None:
        """Prepare the model; `margin` is the largest distance that is computed [m].

        Without `solids`, the payload is a cylinder with its principal moments. Raises `PlantError` for a faulty model
        file.
        """
        spec = full_spec(plant.robot.model, plant.robot.flange)
        spec.option.disableflags = 0
        _set_planes_apart(spec)
        neighbours = list(pairwise(stand_in(spec, plant.robot)))
        groups, beside = _groups(spec)
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
        neighbours += [(one, other) for one in beside for other in groups[1]]
        for one, other in dict.fromkeys(neighbours):
            spec.add_exclude(bodyname1=one, bodyname2=other)
        self._margin = margin
        with compiled(plant.robot.model):
            self._model = spec.compile()
            arm, moving = ({name for names in some for name in names} for some in (groups, groups[1:]))
            self.always_near = self._near_everywhere(arm, {body.name, *moving})
            if self.always_near:
                for one, other in self.always_near:
                    spec.add_exclude(bodyname1=one, bodyname2=other)
                self._model = spec.compile()
        self._data = mujoco.MjData(self._model)

    def __call__(self, q: Array) -> Array:
        """Return the smallest distance at each position (N, n) [m], negative for overlaps, at most `margin`."""
        out = np.full(len(q), self._margin)
        for k, position in enumerate(q):
            contact = self._contacts(position, self._data)
            if len(contact.dist):
                out[k] = min(self._margin, contact.dist.min())
        return out

    def _near_everywhere(self, *among: set[str]) -> tuple[tuple[str, ...], ...]:
        """Return pairs of bodies within one of these sets that are too near at `NEARLY_ALL` random positions."""
        model, data, near = self._model, mujoco.MjData(self._model), Counter[tuple[str, ...]]()
        lower, upper = np.where(model.jnt_limited[:, None], model.jnt_range, (-np.pi, np.pi)).T
        for k, q in enumerate(np.random.default_rng(0).uniform(lower, upper, (100, model.njnt)), 1):
            contact = self._contacts(q, data)
            bodies = model.geom_bodyid[contact.geom[contact.dist < CLEARANCE]].tolist()
            near.update({tuple(sorted((model.body(one).name, model.body(other).name))) for one, other in bodies})
            if max(near.values(), default=0) < k - (100 - NEARLY_ALL):
                return ()
        found = sorted(pair for pair, times in near.items() if times >= NEARLY_ALL)
        return tuple(pair for pair in found if any(names >= {*pair} for names in among))

    def _contacts(self, q: Array, data: mujoco.MjData) -> mujoco.MjContact:
        data.qpos[:] = q
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_comPos(self._model, data)
        mujoco.mj_collision(self._model, data)
        return data.contact


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


def _groups(spec: mujoco.MjSpec) -> tuple[list[list[str]], list[str]]:
    """Return names of bodies that move together, the base first, and of static ones beside the arm."""
    below = [{joint.parent.name, *(each.name for each in joint.parent.find_all("body"))} for joint in spec.joints]
    moving = [sorted(mine - farther) for mine, farther in pairwise([*below, set[str]()])]
    beside = {geom.parent.name for geom in spec.geoms if geom.type == PLANE}
    for body in spec.bodies[1:]:
        if body.name not in below[0] and not body.find_all(mujoco.mjtObj.mjOBJ_JOINT):
            beside.add(body.name)
    base = sorted({body.name for body in spec.bodies} - below[0] - beside)
    return [base, *moving], sorted(beside)
