"""Model files as cheap and small arms have them: weak joints, jaws behind the wrist, slides, no limits at all."""

LINK = '<inertial pos="{x} -0.004 {z}" mass="{mass}" diaginertia="{i} {i} {thin}"/>'


def _body(name: str, pos: str, mass: float, length: float, joint: str, *, along: str = "z", shape: bool = True) -> str:
    """The opening of a body with a joint; the link reaches along one of its axes."""
    x, z = (0.45 * length, 0.002) if along == "x" else (0.003, 0.45 * length)
    i = 0.11 * mass * length**2 + 1e-6
    end = f"{length} 0 0" if along == "x" else f"0 0 {length}"
    geom = f'<geom type="capsule" fromto="0 0 0 {end}" size="{0.09 * length + 0.008:.4g}"/>' if shape else ""
    return f'<body name="{name}" pos="{pos}">{LINK.format(x=x, z=z, mass=mass, i=i, thin=0.3 * i)}{joint}{geom}'


def _model(name: str, bodies: list[str], *, tail: str = "") -> str:
    return (
        f'<mujoco model="{name}"><compiler angle="radian" autolimits="true"/><worldbody>'
        f'<geom type="plane" size="2 2 0.1"/>{"".join(bodies)}{"</body>" * len(bodies)}</worldbody>{tail}</mujoco>'
    )


def scara() -> str:
    """Two joints that turn about upright axes, a quill that slides down, and its rotation; no torque is stated."""
    return _model(
        "scara",
        [
            _body("inner", "0 0 0.38", 4.1, 0.325, '<joint name="shoulder" axis="0 0 1" range="-2.3 2.3"/>', along="x"),
            _body(
                "outer", "0.325 0 0.03", 2.7, 0.275, '<joint name="elbow" axis="0 0 1" range="-2.5 2.5"/>', along="x"
            ),
            _body("quill", "0.275 0 -0.1", 0.6, 0.2, '<joint name="lift" type="slide" axis="0 0 -1" range="0 0.17"/>'),
            _body("tool", "0 0 -0.03", 0.21, 0.02, '<joint name="spin" axis="0 0 1" range="-3.1 3.1"/>'),
        ],
    )


def with_jaw(*, jaw: str = "jaw") -> str:
    """Five joints and a jaw, of the size and torques of arms from hobby servos.

    Args:
        jaw: Name of the last joint.
    """
    limit = 'actuatorfrcrange="-{0} {0}"'
    return _model(
        "with_jaw",
        [
            _body(
                "turret",
                "0 0 0.06",
                0.11,
                0.05,
                f'<joint name="pan" axis="0 0 1" range="-1.9 1.9" {limit.format(2.9)}/>',
            ),
            _body(
                "upper",
                "0.03 0 0.05",
                0.12,
                0.113,
                f'<joint name="lift" axis="0 1 0" range="-1.7 1.6" {limit.format(2.9)}/>',
            ),
            _body(
                "lower",
                "0 0 0.113",
                0.10,
                0.135,
                f'<joint name="elbow" axis="0 1 0" range="-1.6 1.7" {limit.format(2.9)}/>',
            ),
            _body(
                "hand",
                "0 0 0.135",
                0.08,
                0.06,
                f'<joint name="bend" axis="0 1 0" range="-1.6 1.6" {limit.format(2.9)}/>',
            ),
            _body(
                "palm",
                "0 0 0.06",
                0.09,
                0.03,
                f'<joint name="roll" axis="0 0 1" range="-2.7 2.8" {limit.format(2.9)}/>',
            ),
            _body(
                "claw_part",
                "0.02 0 0.03",
                0.015,
                0.06,
                f'<joint name="{jaw}" axis="0 1 0" range="-0.2 1.7" {limit.format(2.9)}/>',
            ),
        ],
    )


def weak(torque: float = 4.6) -> str:
    """Six joints, of which the second hardly lifts the arm where it stretches out.

    Args:
        torque: Largest torque of every joint [N m]; stretched out, the second needs 4.5.
    """
    axes = (("0 0 1", 2.6), ("0 1 0", 1.9), ("0 1 0", 2.3), ("0 1 0", 1.6), ("1 0 0", 1.5), ("0 0 1", 2.1))
    masses, lengths = (0.4, 0.7, 0.5, 0.31, 0.2, 0.16), (0.07, 0.26, 0.24, 0.08, 0.05, 0.06)
    bodies, above = [], 0.06
    for k, ((axis, most), mass, length) in enumerate(zip(axes, masses, lengths, strict=True), 1):
        joint = f'<joint name="m{k}" axis="{axis}" range="{-most} {most - 0.1}" actuatorfrcrange="{-torque} {torque}"/>'
        bodies.append(_body(f"part{k}", f"0 0 {above}", mass, length, joint))
        above = length
    return _model("weak", bodies)


def no_limits() -> str:
    """Seven joints in a URDF, some without ends, of which no effort and no speed is stated."""
    text, above, height = '<link name="base"/>', "base", 0.2
    for k in range(7):
        mass, length = 3.3 * 0.83**k, 0.24 * 0.87**k
        i, axis = 0.09 * mass * length**2, ("0 0 1", "0 1 0")[k % 2]
        ends = '<limit lower="-2.1" upper="2.2" effort="0" velocity="0"/>' if k % 2 else ""
        text += (
            f'<link name="l{k}"><inertial><origin xyz="0.011 -0.007 {0.5 * length:.4g}"/><mass value="{mass:.4g}"/>'
            f'<inertia ixx="{i:.4g}" iyy="{0.9 * i:.4g}" izz="{0.4 * i:.4g}" ixy="0" ixz="0" iyz="0"/>'
            "</inertial></link>"
            f'<joint name="a{k}" type="{"revolute" if ends else "continuous"}"><parent link="{above}"/>'
            f'<child link="l{k}"/><origin xyz="0 0 {height:.4g}"/><axis xyz="{axis}"/>{ends}</joint>'
        )
        above, height = f"l{k}", length
    return f'<robot name="no_limits">{text}</robot>'
