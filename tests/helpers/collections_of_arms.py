"""Model files in the style of common collections: MJCF with servos and keyframes, URDF with meshes and grippers."""

from pathlib import Path

INERTIAL = '<inertial pos="0.02 -0.01 0.12" mass="{mass}" diaginertia="0.03 0.028 0.012"/>'
MJCF_LINKS = (
    ("shoulder", "0 0 0.2", "0 0 1", 6.0),
    ("elbow", "0 0.05 0.15", "0 1 0", 4.0),
    ("wrist", "0 0 0.3", "1 0 0", 2.0),
)
URDF_INERTIAL = (
    '<inertial><origin xyz="0.02 -0.01 0.12" rpy="0.1 0 0"/><mass value="{mass}"/>'
    '<inertia ixx="0.03" ixy="0" ixz="0.001" iyy="0.028" iyz="0" izz="0.012"/></inertial>'
)
MESHES = (
    '<visual><geometry><mesh filename="package://robot_description/meshes/{name}.dae" scale="0.001 0.001 0.001"/>'
    "</geometry></visual>"
    '<collision><geometry><mesh filename="package://robot_description/meshes/{name}.stl"/></geometry></collision>'
)


def menagerie(
    *, head: str = "", world: str = "", hand: str = "", tail: str = "", joint: str = "", inertial: str = INERTIAL
) -> str:
    """MJCF as collections have it: default classes, position servos, a keyframe, meshes, a floor.

    Args:
        head: Sections before the worldbody.
        world: Elements of the worldbody beside the arm.
        hand: Inside the last link.
        tail: Sections behind.
        joint: Attributes of the elbow's joint.
        inertial: Of every link.
    """
    bodies = "".join(
        f'<body name="{name}_link" pos="{pos}">{inertial.format(mass=mass)}'
        f'<joint name="{name}" axis="{axis}" {joint if name == "elbow" else ""}/>'
        f'<geom class="visual" mesh="{name}"/><geom class="collision" fromto="0 0 0 0 0 0.15" size="0.05"/>'
        for name, pos, axis, mass in MJCF_LINKS
    )
    servos = "".join(f'<position class="arm" name="{n}_servo" joint="{n}"/>' for n, *_ in MJCF_LINKS)
    meshes = "".join(f'<mesh file="{name}.obj"/>' for name, *_ in MJCF_LINKS)
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
<body name="base" childclass="arm">{bodies}{hand}{"</body>" * len(MJCF_LINKS)}</body></worldbody>
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
    """URDF as ROS packages have it: world link, massless frames, meshes in packages, effort and velocity limits.

    Args:
        kinds: Types of the joints.
        more: Links and joints behind `tool0`.
        inertial: Whether the links state inertias.
    """
    text, above = '<link name="world"/><link name="base_link"/>', "base_link"
    text += '<joint name="fixed_base" type="fixed"><parent link="world"/><child link="base_link"/>'
    text += '<origin xyz="0 0 0.1"/></joint>'
    for k, ((name, pos, axis, mass), kind) in enumerate(zip(MJCF_LINKS, kinds, strict=True)):
        low, high = ("0.05", "0.6") if kind == "prismatic" else ("-2.4", "2.5")
        velocity = 0.5 if kind == "prismatic" else 2.5
        limit = f'<limit lower="{low}" upper="{high}" effort="{120 - 30 * k}" velocity="{velocity}"/>'
        text += (
            f'<link name="{name}_link">{URDF_INERTIAL.format(mass=mass) if inertial else ""}'
            f"{MESHES.format(name=name)}</link>"
            f'<joint name="{name}" type="{kind}"><parent link="{above}"/><child link="{name}_link"/>'
            f'<origin xyz="{pos}" rpy="0 0 0"/><axis xyz="{axis}"/>{limit}<dynamics damping="0.0" friction="0.0"/>'
            f'<safety_controller k_velocity="10"/></joint>'
        )
        above = f"{name}_link"
    text += '<link name="tool0"/><joint name="tool0_fixed" type="fixed">'
    text += f'<parent link="{above}"/><child link="tool0"/></joint>'
    return f'<?xml version="1.0"?><robot name="ros_arm">{text}{more}</robot>'


GRIPPER = "".join(
    f'<link name="finger_{side}">{URDF_INERTIAL.format(mass=0.1)}</link><joint name="{joint}" type="prismatic">'
    f'<parent link="tool0"/><child link="finger_{side}"/><axis xyz="0 {sign} 0"/>'
    f'<limit lower="0" upper="0.04" effort="9" velocity="1"/>{mimic}</joint>'
    for side, joint, sign, mimic in (("l", "grip", 1, ""), ("r", "grip_r", -1, '<mimic joint="grip"/>'))
)


def written(folder: Path, name: str, text: str) -> Path:
    """A model file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text)
    return path
