"""The arm of a model file: joints from the world to the flange move, all others are locked or removed.

The links with their inertias, the joints with their places and ranges, and gravity are used. Drives, friction and rotor
inertias come from the robot file; sensors, keyframes, contacts, solver settings and fluids are ignored. Springs and
constraints between moving joints are refused, because the identification model lacks them.

A mesh is only visual if its link states an inertia, and is omitted if it is missing or not a solid; it is required if
the inertia is computed from it. A simulation needs no shapes, and compiles and steps faster without them: `lean_spec`
removes them unless inertias are computed from them. Arms are cached, because this takes longer than compiling a trial.
"""

from collections.abc import Generator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from ident.support.errors import placed
from sim.errors import PlantError

INERTIAL = ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat")
"""Attributes of a model that are the same with and without shapes, if no inertia is computed from them."""
DROPPED = ("sensors", "keys", "pairs", "excludes", "actuators", "equalities", "tendons", "flexes", "skins")
"""Elements of a file that are removed; equalities and tendons are checked first."""
ADDED = ("joint", "actuator", "tendon", "geom")
"""Kinds of elements that a simulation adds, for which default classes of the file do not hold."""
KEPT = ("gravity", "id", "signature", "classname", "compiler", "frame", "parent", "plugin", "default")
"""Attributes of options and defaults that stay; those of defaults, MuJoCo cannot read."""
GRIPPER = "remove it; if it belongs to a gripper, name the arm's last body as flange"
"""Advice for a constraint between joints."""
FREE = mujoco.mjtJoint.mjJNT_FREE
ONE_AXIS = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
SUPPORT = "table under the arm"
"""Beginning of the names of joints under the arm."""
PACKAGE, FILE = "package://", "file://"


@contextmanager
def silenced() -> Generator[None]:
    """Suppress MuJoCo's lines on stderr and in `MUJOCO_LOG.TXT`: they become our errors; also a decorator."""
    before, config = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    config.logto_console = config.logto_file = False
    config.set()
    try:
        yield
    finally:
        before.set()


def full_spec(path: Path, flange: str | None = None) -> mujoco.MjSpec:
    """Return the arm of a model file with its shapes, without contacts; joints beside the chain to a flange are locked.

    Raises `ValueError` if MuJoCo cannot read it, `PlantError` if it is not an arm, or the mesh of an inertia is
    missing.
    """
    return _drawn(path, flange, file_stamp(path))[0].copy()


def unusable_meshes(path: Path, flange: str | None = None) -> tuple[str, ...]:
    """Return the files of meshes that are missing or not solids; arguments and errors as `full_spec`."""
    return _drawn(path, flange, file_stamp(path))[1]


def lean_spec(path: Path, flange: str | None = None) -> mujoco.MjSpec:
    """Return a copy of the arm without visual elements, unless inertias come from them; raises as `full_spec`."""
    return _lean(path, flange, file_stamp(path)).copy()


def file_stamp(path: Path) -> int:
    """Time of the last change of a file, 0 if there is none: part of the key of whatever is cached of a model."""
    return path.stat().st_mtime_ns if path.is_file() else 0


def driven_joints(model: mujoco.MjModel) -> slice:
    """Return the places of the joints that drives turn, among all joints: those of the arm, or its elastic motors."""
    if model.actuator_trntype[0] == mujoco.mjtTrn.mjTRN_TENDON:  # motors that several joints turn
        return arm_joints(model)
    first = int(model.actuator_trnid[0, 0])
    return slice(first, first + model.nu)


def arm_joints(model: mujoco.MjModel) -> slice:
    """Return the places of the arm's joints; in front of them are those of what it stands on, if that moves."""
    first = sum(model.joint(k).name.startswith(SUPPORT) for k in range(model.njnt))
    return slice(first, first + model.nu)


@contextmanager
def compiled(model: object) -> Generator[None]:
    """Convert errors of MuJoCo's compiler to a `PlantError` in one line that names the model and the element."""
    try:
        yield
    except ValueError as error:
        what, *details = str(error).removeprefix("Error: ").splitlines()
        names = (line.partition("'")[2].partition("'")[0] for line in details if line.startswith("Element name"))
        if element := next(names, ""):
            what += f" (element {element!r})"
        if "mass and inertia of moving bodies" in what:
            what = f"link {element!r} has no mass or no moments of inertia; state an inertial with both"
        if "A + B >= C" in what:
            what = f"link {element!r}: one principal moment of inertia exceeds the sum of the others; correct it"
        raise PlantError(f"robot model {model}: {what}") from error


@lru_cache(maxsize=8)
def _drawn(path: Path, flange: str | None, stamp: int) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """The arm with all shapes that can be compiled, and the files of others."""
    spec, missing = _read(path, flange)
    solid = spec.copy()
    for geom in solid.geoms:
        geom.contype = geom.conaffinity = 1  # as for distances: a visual mesh may have no convex hull
    try:
        solid.compile()
    except ValueError:
        missing += _drop_meshes(spec, path, flange, compiled=True)
    return spec, missing


@lru_cache(maxsize=8)
def _lean(path: Path, flange: str | None, stamp: int) -> mujoco.MjSpec:
    lean, _ = _read(path, flange)
    for kind in ("geoms", "materials", "textures", "meshes", "hfields", "lights", "cameras"):
        for element in list(getattr(lean, kind)):
            lean.delete(element)
    try:
        stripped = lean.compile()
    except ValueError:
        return full_spec(path, flange)  # a moving body that states no inertia
    whole = full_spec(path, flange).compile()
    same = all(np.array_equal(getattr(stripped, name), getattr(whole, name)) for name in INERTIAL)
    return lean if same else full_spec(path, flange)


def _read(path: Path, flange: str | None) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """The arm with shapes that have their files, and the files that are missing."""
    spec = mujoco.MjSpec.from_file(str(path))
    if path.suffix.lower() == ".urdf":  # inertias are stated; a collision shape is not a link
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    with placed(f"robot model {path}"):
        hold_all_but_arm(spec, flange)
    missing = _drop_meshes(spec, path, flange)
    spec.compiler.fusestatic = False  # bodies keep their names, and an empty payload is a body
    # Without islands the solver is faster with the same result: an arm is a single island.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_ISLAND
    return spec, missing


def hold_all_but_arm(spec: mujoco.MjSpec, flange: str | None) -> None:
    """Reduce a model in place to the named joints of an arm; `PlantError` for other joints, springs or constraints."""
    if flange is None:  # with a flange, the reader of the identification reports constraints on the arm, with lines
        for tie in spec.equalities:
            if tie.active:
                raise PlantError(f"equality {tie.name or tie.name1!r} couples joints; {GRIPPER}")
        for tendon in spec.tendons:
            if any(tendon.stiffness) or any(tendon.damping) or tendon.frictionloss:
                raise PlantError(f"tendon {tendon.name!r} acts on joints; {GRIPPER}")
    for kind in DROPPED:
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    body = spec.worldbody.first_body()
    while body is not None:  # free-floating bodies that do not carry the flange
        following = spec.worldbody.next_body(body)
        joints = body.find_all(mujoco.mjtObj.mjOBJ_JOINT)
        names = [body.name, *(each.name for each in body.find_all(mujoco.mjtObj.mjOBJ_BODY))]
        if joints and all(joint.type == FREE for joint in joints) and (flange is None or flange not in names):
            spec.delete(body)
        body = following
    if flange is not None:
        arm = _bodies_to(spec, flange)
        while len(arm) > 1 and not arm[-1].joints:  # what the arm stands on
            arm.pop()
        for joint in list(spec.joints):
            if not any(joint.parent is each for each in arm):
                spec.delete(joint)
        for body in spec.bodies:
            if body.explicitinertial and not any(body is each for each in arm):
                _give_possible_inertia(body)
    for number, body in enumerate(spec.bodies):
        body.name = body.name or f"body {number}"
        body.gravcomp = 0.0
    for number, joint in enumerate(spec.joints, 1):
        joint.name = joint.name or f"joint{number}"
        joint.actfrclimited = 0  # drive torques are stated in the robot file
        if joint.type not in ONE_AXIS:
            raise PlantError(f"joint {joint.name} is free or a ball; expected hinge and slide joints on a fixed base")
        if any(joint.stiffness):
            raise PlantError(
                f"joint {joint.name} has a spring, stiffness = {joint.stiffness[0]:g}, which "
                "identification does not model; remove it"
            )
    plain = mujoco.MjSpec()
    usual = [(spec.option, plain.option)]  # flags may disable friction, and a fluid would damp the arm
    usual += [(getattr(spec.default, kind), getattr(plain.default, kind)) for kind in ADDED]
    for own, other in usual:
        for name in (name for name in dir(other) if not name.startswith("_") and name not in KEPT):
            if hasattr(value := getattr(other, name), "__int__"):  # a number, an array, or an enumeration
                setattr(own, name, value)


def _bodies_to(spec: mujoco.MjSpec, flange: str) -> list[mujoco.MjsBody]:
    """The bodies from a flange to the world, both included."""
    body = spec.body(flange)
    if body is None:
        raise PlantError(f"flange {flange!r}: no body has that name")
    found = [body]
    while (body := body.parent) is not None:
        found.append(body)
    return found


def _give_possible_inertia(body: mujoco.MjsBody) -> None:
    """Replace impossible moments, which MuJoCo would refuse, by those of a sphere, and negative masses by zero."""
    full = body.fullinertia
    xx, yy, zz, xy, xz, yz = (*body.inertia, 0.0, 0.0, 0.0) if np.isnan(full[0]) else full
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if body.mass < 0.0 or moments[0] < 0.0 or moments[0] + moments[1] < moments[2]:
        body.mass, body.fullinertia = max(body.mass, 0.0), np.full(6, np.nan)
        body.inertia = np.full(3, np.abs(moments).mean())


def _drop_meshes(spec: mujoco.MjSpec, path: Path, flange: str | None, *, compiled: bool = False) -> tuple[str, ...]:
    """Remove meshes without a file or, if compiled, that are no solid, and their shapes; return their files."""
    arm = None if flange is None else _bodies_to(spec, flange)
    folder = path.parent / (spec.compiler.meshdir or "")
    unusable: dict[str, str] = {}
    for mesh in spec.meshes:
        stated, name = mesh.file, mesh.name or Path(mesh.file).stem
        if stated.startswith((PACKAGE, FILE)):
            mesh.file = str(_in_package(stated, path))
        if stated and not ((folder / mesh.file).is_file() and (not compiled or _is_solid(mesh, folder / mesh.file))):
            unusable[name] = stated
    from_shapes = spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for shape in [geom for geom in spec.geoms if geom.meshname in unusable]:
        link, weighs = shape.parent, shape.mass != 0.0 and shape.density != 0.0  # NaN where no mass is stated
        moving = link
        while moving is not None and not moving.joints:
            moving = moving.parent
        counts = from_shapes and weighs and not link.explicitinertial and moving is not None
        if counts and (arm is None or any(link is each for each in arm)):
            fault = "from which MuJoCo cannot make a solid; correct" if compiled else "which does not exist; add"
            raise PlantError(
                f"robot model {path}: link {link.name!r} has its inertia from the mesh {unusable[shape.meshname]!r}, "
                f"{fault} the file, or state an inertial"
            )
        spec.delete(shape)
    for mesh in [mesh for mesh in spec.meshes if (mesh.name or Path(mesh.file).stem) in unusable]:
        spec.delete(mesh)
    return tuple(unusable.values())


def _in_package(stated: str, path: Path) -> Path:
    """Return the file of a URI; packages are found above the model by folder name or by `package.xml`."""
    if stated.startswith(FILE):
        return Path(stated.removeprefix(FILE))
    package, _, inside = stated.removeprefix(PACKAGE).partition("/")
    for folder in path.resolve().parents:
        try:
            name = ElementTree.parse(folder / "package.xml").findtext("name", "").strip()
        except (OSError, ElementTree.ParseError):
            name = ""
        beside = folder if package in (folder.name, name) else folder / package
        if (beside / inside).is_file():
            return beside / inside
    return path.parent / package / inside


def _is_solid(mesh: mujoco.MjsMesh, file: Path) -> bool:
    """Return whether MuJoCo can compile a mesh."""
    alone = mujoco.MjSpec()
    alone.add_mesh(name="mesh", file=str(file), scale=mesh.scale, inertia=mesh.inertia)
    alone.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    try:
        alone.compile()
    except ValueError:
        return False
    return True
