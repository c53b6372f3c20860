"""Texts of model files: a UR-like arm, arms in the style of common collections, small and random arms."""

from collections.abc import Sequence
from pathlib import Path

KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
LINKS = (
    ("shoulder_pan", "0 0 0.163", "0 0 0", "0 0 1"),
    ("shoulder_lift", "0 0.138 0", "0 90 0", "0 1 0"),
    ("elbow", "0 -0.131 0.613", "0 0 0", "0 1 0"),
    ("wrist_1", "0 0 0.571", "0 90 0", "0 1 0"),
    ("wrist_2", "0 0.127 0", "0 0 0", "0 0 1"),
    ("wrist_3", "0 0 0.119", "0 0 0", "0 1 0"),
)
"""Joint, place [m], roll-pitch-yaw or MJCF euler angles [deg], axis; base to flange."""
RADIANS = {"0 0 0": "0 0 0", "0 90 0": "0 1.5707963267948966 0"}
INERTIAL = '<inertial pos="0 0 0.1" mass="2.5" diaginertia="0.02 0.03 0.04"/>'


def written(folder: Path, name: str, text: str) -> Path:
    """A model file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text)
    return path


def urdf_link(name: str, mass: object, moments: Sequence[object], origin: str, more: str = "") -> str:
    """A link; moments in the order of `KEYS`."""
    inertia = " ".join(f'{key}="{value}"' for key, value in zip(KEYS, moments, strict=True))
    return f'<link name="{name}"><inertial>{origin}<mass value="{mass}"/><inertia {inertia}/></inertial>{more}</link>'


def urdf_joint(name: str, kind: str, ends: tuple[str, str], *parts: str) -> str:
    """A joint between two links, with further elements."""
    parent, child = ends
    links = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{links}{"".join(parts)}</joint>'


def ends(lower: object, upper: object, effort: object, velocity: object) -> str:
    """The limits of a joint of a URDF."""
    return f'<limit lower="{lower}" upper="{upper}" effort="{effort}" velocity="{velocity}"/>'


def mjcf(
    *,
    head: str = '<compiler angle="degree" autolimits="true"/>',
    base: str = "",
    world: str = "",
    tail: str = "",
    links: Sequence[tuple[str, str, str, str]] = LINKS,
    swap: tuple[str, str] = ("", ""),
) -> str:
    """An MJCF file of the UR-like arm."""
    bodies = "".join(
        f'\n<body name="{name}_link" pos="{pos}" euler="{euler}">{INERTIAL}'
        f'<joint name="{name}_joint" axis="{axis}" range="-170 175"/>'
        for name, pos, euler, axis in links
    )
    text = (
        f'<mujoco model="ur">\n{head}\n<worldbody>{world}<body name="base" {base}>{INERTIAL}{bodies}'
        f"{'</body>' * len(links)}</body></worldbody>\n{tail}</mujoco>\n"
    )
    return _swapped(text, swap)


def urdf(*, more: str = "", swap: tuple[str, str] = ("", "")) -> str:
    """A URDF file of the UR-like arm."""
    links, above = '<link name="base"/>', "base"
    for name, pos, rpy, axis in LINKS:
        place = f'<origin xyz="{pos}" rpy="{RADIANS[rpy]}"/><axis xyz="{axis}"/>'
        joint = urdf_joint(f"{name}_joint", "revolute", (above, f"{name}_link"), place, ends(-2.97, 3.05, 150, 3.1))
        links += f'\n<link name="{name}_link"/>{joint}'
        above = f"{name}_link"
    return _swapped(f'<robot name="ur">\n{links}\n{more}</robot>\n', swap)


def _swapped(text: str, swap: tuple[str, str]) -> str:
    assert swap[0] in text, f"{swap[0]!r} is not in the text"
    return text.replace(swap[0], swap[1], 1) if swap[0] else text


IN_COLLECTION = '<inertial pos="0.02 -0.01 0.12" mass="{mass}" diaginertia="0.03 0.028 0.012"/>'
COLLECTED = (
    ("shoulder", "0 0 0.2", "0 0 1", 6.0),
    ("elbow", "0 0.05 0.15", "0 1 0", 4.0),
    ("wrist", "0 0 0.3", "1 0 0", 2.0),
)
"""Joint, place [m], axis, mass [kg]."""
TURNED = '<origin xyz="0.02 -0.01 0.12" rpy="0.1 0 0"/>'
MOMENTS = (0.03, 0.028, 0.012, 0, 0.001, 0)
MESHES = (
    '<visual><geometry><mesh filename="package://robot_description/meshes/{name}.dae" scale="0.001 0.001 0.001"/>'
    "</geometry></visual>"
    '<collision><geometry><mesh filename="package://robot_description/meshes/{name}.stl"/></geometry></collision>'
)


def menagerie(
    *, head: str = "", world: str = "", hand: str = "", tail: str = "", joint: str = "", inertial: str = IN_COLLECTION
) -> str:
    """MJCF as collections have it: default classes, position servos, a keyframe, meshes, a floor."""
    bodies = "".join(
        f'<body name="{name}_link" pos="{pos}">{inertial.format(mass=mass)}'
        f'<joint name="{name}" axis="{axis}" {joint if name == "elbow" else ""}/>'
        f'<geom class="visual" mesh="{name}"/><geom class="collision" fromto="0 0 0 0 0 0.15" size="0.05"/>'
        for name, pos, axis, mass in COLLECTED
    )
    servos = "".join(f'<position class="arm" name="{n}_servo" joint="{n}"/>' for n, *_ in COLLECTED)
    meshes = "".join(f'<mesh file="{name}.obj"/>' for name, *_ in COLLECTED)
    return f"""<mujoco model="menagerie arm">
<compiler angle="radian" meshdir="assets" autolimits="true"/>
<option integrator="implicitfast" cone="elliptic" impratio="10"/>
<default>
  <default class="arm"><joint damping="5" armature="0.1" range="-2.6 2.6" frictionloss="0.3"/>
    <position kp="200" kv="20" ctrlrange="-2.6 2.6" forcerange="-80 80"/>
    <default class="visual"><geom type="mesh" contype="0" conaffinity="0" group="2"/></default>
    <default class="collision"><geom type="capsule" group="3"/></default>
  </default>
</default>
<asset>{meshes}</asset>{head}
<worldbody><light pos="0 0 3"/><geom name="floor" type="plane" size="0 0 0.05"/>{world}
<body name="base" childclass="arm">{bodies}{hand}{"</body>" * len(COLLECTED)}</body></worldbody>
<actuator>{servos}</actuator>{tail}</mujoco>"""


HAND = (
    '<body name="hand" pos="0 0 0.1"><inertial pos="0 0 0.05" mass="0.7" diaginertia="0.001 0.002 0.002"/>'
    '<body name="left"><inertial pos="0 0 0.05" mass="0.02" diaginertia="1e-5 1e-5 1e-5"/>'
    '<joint name="finger1" type="slide" axis="0 1 0" range="0 0.04"/></body>'
    '<body name="right"><inertial pos="0 0 0.05" mass="0.02" diaginertia="1e-5 1e-5 1e-5"/>'
    '<joint name="finger2" type="slide" axis="0 -1 0" range="0 0.04"/></body></body>'
)
FINGERS = (
    '<equality><joint joint1="finger1" joint2="finger2"/></equality>'
    '<tendon><fixed name="split"><joint joint="finger1" coef="0.5"/><joint joint="finger2" coef="0.5"/></fixed>'
    "</tendon>"
)
HOME = '<keyframe><key name="home" qpos="0 0.4 -0.7" ctrl="0 0.4 -0.7"/></keyframe>'
TABLE = (
    '<body name="table" pos="0.8 0 0.1"><geom type="box" size="0.2 0.3 0.1"/></body>'
    '<body name="cup" pos="0.8 0 0.3"><freejoint/><geom type="cylinder" size="0.03 0.05" mass="0.2"/></body>'
)


def ros(
    *, kinds: tuple[str, ...] = ("revolute", "continuous", "prismatic"), more: str = "", inertial: bool = True
) -> str:
    """URDF as ROS packages have it: world link, massless frames, meshes in packages, effort and velocity limits."""
    text, above = '<link name="world"/><link name="base_link"/>', "base_link"
    text += urdf_joint("fixed_base", "fixed", ("world", "base_link"), '<origin xyz="0 0 0.1"/>')
    rest = '<dynamics damping="0.0" friction="0.0"/><safety_controller k_velocity="10"/>'
    for k, ((name, pos, axis, mass), kind) in enumerate(zip(COLLECTED, kinds, strict=True)):
        low, high, velocity = (0.05, 0.6, 0.5) if kind == "prismatic" else (-2.4, 2.5, 2.5)
        mesh = MESHES.format(name=name)
        link = urdf_link(f"{name}_link", mass, MOMENTS, TURNED, mesh)
        text += link if inertial else f'<link name="{name}_link">{mesh}</link>'
        place = f'<origin xyz="{pos}" rpy="0 0 0"/><axis xyz="{axis}"/>'
        text += urdf_joint(name, kind, (above, f"{name}_link"), place, ends(low, high, 120 - 30 * k, velocity), rest)
        above = f"{name}_link"
    text += f'<link name="tool0"/>{urdf_joint("tool0_fixed", "fixed", (above, "tool0"))}'
    return f'<?xml version="1.0"?><robot name="ros_arm">{text}{more}</robot>'


GRIPPER = "".join(
    urdf_link(f"finger_{side}", 0.1, MOMENTS, TURNED)
    + urdf_joint(joint, "prismatic", ("tool0", f"finger_{side}"), f'<axis xyz="0 {y} 0"/>', ends(0, 0.04, 9, 1), mimic)
    for side, joint, y, mimic in (("l", "grip", 1, ""), ("r", "grip_r", -1, '<mimic joint="grip"/>'))
)


def with_jaw() -> str:
    """Five joints and a jaw, of the size and torques of arms from hobby servos, in MJCF; links reach along z."""
    bodies = ""
    for link, pos, mass, length, joint in (
        ("turret", "0 0 0.06", 0.11, 0.05, 'name="pan" axis="0 0 1" range="-1.9 1.9"'),
        ("upper", "0.03 0 0.05", 0.12, 0.113, 'name="lift" axis="0 1 0" range="-1.7 1.6"'),
        ("lower", "0 0 0.113", 0.10, 0.135, 'name="elbow" axis="0 1 0" range="-1.6 1.7"'),
        ("hand", "0 0 0.135", 0.08, 0.06, 'name="bend" axis="0 1 0" range="-1.6 1.6"'),
        ("palm", "0 0 0.06", 0.09, 0.03, 'name="roll" axis="0 0 1" range="-2.7 2.8"'),
        ("claw_part", "0.02 0 0.03", 0.015, 0.06, 'name="jaw" axis="0 1 0" range="-0.2 1.7"'),
    ):
        i = 0.11 * mass * length**2 + 1e-6
        bodies += (
            f'<body name="{link}" pos="{pos}"><inertial pos="0.003 -0.004 {0.45 * length}" mass="{mass}" '
            f'diaginertia="{i} {i} {0.3 * i}"/><joint {joint} actuatorfrcrange="-2.9 2.9"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 {length}" size="{0.09 * length + 0.008:.4g}"/>'
        )
    return (
        '<mujoco model="with_jaw"><compiler angle="radian" autolimits="true"/><worldbody>'
        f'<geom type="plane" size="2 2 0.1"/>{bodies}{"</body>" * 6}</worldbody></mujoco>'
    )


def no_limits() -> str:
    """Seven joints in a URDF, some without ends, of which no effort and no speed is stated."""
    text, above, height = '<link name="base"/>', "base", 0.2
    for k in range(7):
        mass, length = 3.3 * 0.83**k, 0.24 * 0.87**k
        i, axis = 0.09 * mass * length**2, ("0 0 1", "0 1 0")[k % 2]
        moments = (f"{i:.4g}", f"{0.9 * i:.4g}", f"{0.4 * i:.4g}", 0, 0, 0)
        text += urdf_link(f"l{k}", f"{mass:.4g}", moments, f'<origin xyz="0.011 -0.007 {0.5 * length:.4g}"/>')
        place = f'<origin xyz="0 0 {height:.4g}"/><axis xyz="{axis}"/>'
        kind, limit = ("revolute", ends(-2.1, 2.2, 0, 0)) if k % 2 else ("continuous", "")
        text += urdf_joint(f"a{k}", kind, (above, f"l{k}"), place, limit)
        above, height = f"l{k}", length
    return f'<robot name="no_limits">{text}</robot>'
