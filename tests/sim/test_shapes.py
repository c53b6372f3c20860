import mujoco
import numpy as np
import pytest
from plants import nominal_plant
from robot_folders import arm_xml, robot_folder

from sim.plant import PayloadBody, Plant
from sim.robot import read_robot
from sim.shapes import Clearance, Solid, add_capsules, flange_of


def robot(tmp_path, change=lambda text: text):
    found = read_robot(robot_folder(tmp_path, 2))
    found.model.write_text(change(arm_xml(2)))
    return found


def on_last(text: str, element: str) -> str:
    """An element on the last link."""
    return text.replace("</body></body>", f"{element}</body></body>")


@pytest.mark.parametrize(
    ("element", "name"),
    [
        ('<site name="flange" pos="0.1 0.02 -0.03" xyaxes="0 1 0 0 0 1"/>', "flange"),
        ('<body name="tool0" pos="0.1 0.02 -0.03" xyaxes="0 1 0 0 0 1"/>', "tool0"),
        (
            '<body name="tip" pos="0.1 0 0"><site name="attachment_site" pos="0 0.02 -0.03" '
            'xyaxes="0 1 0 0 0 1"/></body>',
            "attachment_site",
        ),
    ],
)
def test_a_site_or_body_of_a_known_name_on_the_last_link_is_the_flange_seen_from_its_joint(tmp_path, element, name):
    def change(text: str) -> str:
        text = text.replace('<body name="part1"', '<body euler="0.3 -0.2 0.5" name="part1"')
        return on_last(text.replace('<joint name="axis2"', '<joint pos="0.04 -0.013 0.027" name="axis2"'), element)

    flange = flange_of(robot(tmp_path, change))
    assert flange.name == name
    np.testing.assert_allclose(flange.origin, [0.06, 0.033, -0.057], rtol=0, atol=1e-15)
    np.testing.assert_allclose(flange.rotation, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], rtol=0, atol=1e-15)


def test_without_one_the_last_joint_s_axis_stands_for_it_and_a_flange_elsewhere_does_not_count(tmp_path):
    def change(text: str) -> str:
        text = text.replace('<joint name="axis2"', '<joint pos="0.03 -0.01 0.02" name="axis2"')
        return text.replace("<worldbody>", '<worldbody><site name="flange" pos="1 0 0"/>')

    flange = flange_of(robot(tmp_path, change))
    assert flange.name == ""
    np.testing.assert_array_equal(flange.origin, np.zeros(3))  # payloads are measured from there
    np.testing.assert_allclose(flange.rotation[:, 2], [0.0, 1.0, 0.0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.cross(*flange.rotation.T[:2]), flange.rotation[:, 2], rtol=0, atol=1e-15)


MARGIN = 0.2


def test_the_tip_of_the_payload_reaches_the_floor_where_its_length_says():
    # Shoulder at 0.42 m, straight arm of 0.45 + 0.45 + 0.085 m, payload of 0.1156 m and radius 0.0497 m, tilted by q2:
    # the lowest point is the rim of its far face, 0.42 + 1.1006 cos(q2) - 0.0497 sin(q2). The fork is at 0.045 m.
    clearance = Clearance(nominal_plant(), MARGIN)
    q2 = np.array([1.88, 1.89, 1.90])
    poses = np.zeros((3, 6))
    poses[:, 1] = q2
    expected = 0.42 + 1.1006 * np.cos(q2) - 0.0497 * np.sin(q2)
    np.testing.assert_allclose(clearance(poses), expected, atol=1e-3)  # digits of the payload's moments


BODY = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="{}" axis="{}"/>'
BARE_ARM = f"""<mujoco><worldbody>
  <body name="a" pos="0 0 0.5">{BODY.format("j1", "0 1 0")}
    <body {{name}} pos="0 0 0.4">{BODY.format("j2", "0 1 0")}
      <body name="c" pos="0 0 0.3">{BODY.format("j3", "0 1 0")}
        <body name="d" pos="0 0 0.02">{BODY.format("j4", "0 0 1")}
          <body name="e" pos="0 0 0.2">{BODY.format("j5", "0 1 0")}
          {{flange}}</body></body></body></body></body>
  {{floor}}</worldbody></mujoco>"""


LIGHT = PayloadBody(mass=1e-3, com=(0.0, 0.0, 0.0), inertia=(1e-8, 1e-8, 1e-9, 0.0, 0.0, 0.0))


def capsule_plant(tmp_path, flange="", floor="", name='name="b"') -> Plant:
    robot = read_robot(robot_folder(tmp_path, 5))
    robot.model.write_text(BARE_ARM.format(flange=flange, floor=floor, name=name))
    return Plant(robot=robot, drives=robot.drives, payload=LIGHT)


def distances(plant: Plant, *poses: list[float], margin: float = 0.5) -> np.ndarray:
    return Clearance(plant, margin, [])(np.array(poses))


def test_an_arm_without_shapes_has_capsules_of_a_share_of_their_length_over_a_floor(tmp_path):
    # Links of 0.4, 0.3, 0.02 and 0.2 m, the last one to no flange; reach 0.92 m, so that no radius is below 0.0276 m.
    down = float(np.arccos(-0.4 / 0.92))
    low, under = distances(capsule_plant(tmp_path), [down, 0.0, 0.0, 0.0, 0.0], [np.pi, 0.0, 0.0, 0.0, 0.0], margin=0.2)
    assert abs(low - (0.1 - 0.0276)) < 1e-6  # MuJoCo's own tolerance
    assert abs(under - (0.5 - 0.92 - 0.0276)) < 1e-6
    # Folded at joint 3 by half a turn, link d lies along link b, with which it is not compared; what is nearest is the
    # end of link a, 0.048 m thick, 0.3 - 0.02 - 0.2 m below that of d.
    folded = distances(capsule_plant(tmp_path), [0.0, 0.0, np.pi, 0.0, 0.0], margin=0.2)[0]
    assert abs(folded - (0.08 - 0.048 - 0.0276)) < 1e-6


def test_where_in_its_body_the_last_joint_is_moves_neither_flange_nor_weight(tmp_path):
    # A last joint 0.1 m up its link: with its pose at zero, nothing else moves. The weight is where the flange is, and
    # the last capsule ends there; the floor of the file is the only one.
    floor, flange = '<geom type="plane" size="1 1 1" pos="0 0 -0.6"/>', '<site name="flange" pos="0 0 0.35"/>'
    plant = capsule_plant(tmp_path, flange=flange, floor=floor)
    text = plant.robot.model.read_text()
    hanging = np.array([[np.pi, 0.0, 0.0, 0.0, 0.0]])
    found = list[list[float]]()
    for place in ("0 0 0", "0 0 0.1"):
        plant.robot.model.write_text(text.replace('<joint name="j5"', f'<joint name="j5" pos="{place}"'))
        flange = flange_of(plant.robot)
        center = np.add(flange.origin, [0, 0, 0.2])
        box = Solid(cylinder=False, size=(0.03, 0.02, 0.2), center=center, rotation=flange.rotation)
        found.append([Clearance(plant, 2.0, solids)(hanging)[0] for solids in ([], [box])])
    # Radii are 0.12 of the last link's 0.35 and 0.25 m, the latter not below 3 % of the reach.
    np.testing.assert_allclose(found[0], [1.1 - 1.27 - 0.042, 1.1 - 1.67], rtol=0, atol=1e-6)
    np.testing.assert_allclose(found[1], [1.1 - 1.27 - 0.0381, 1.1 - 1.67], rtol=0, atol=1e-6)


def test_a_base_or_floor_drawn_below_the_arm_is_left_out_near_its_joint_alone(tmp_path):
    shape, floor = '<geom type="capsule" fromto="0 0 0 0 0 0.{}" size="0.05"/>', '<geom type="plane" size="1 1 1"/>'
    text = BARE_ARM.format(name='name="b"', flange="", floor="{}")
    for joint, length in (("j1", 4), ("j2", 3), ("j5", 2)):
        text = text.replace(f'<joint name="{joint}"', f'{shape.format(length)}<joint name="{joint}"')
    plant = capsule_plant(tmp_path)
    plant.robot.model.write_text(text.format(f'{floor}<geom type="box" size=".2 .2 .48"/>'))
    upright, over, low = distances(plant, [0.0] * 5, [1.5, 0.0, 0.0, 0.0, 0.0], [2.3, 0.3, -2.5, 0.0, 0.0], margin=0.1)
    assert upright == 0.1  # the first link stands in the base
    assert over == 0.1  # it lies on the base, the others beside it
    stand = text.format("").replace("<worldbody>", f'<worldbody><body name="stand">{floor}')
    plant.robot.model.write_text(stand.replace("</worldbody>", "</body></worldbody>"))
    (on_stand,) = distances(plant, [2.3, 0.3, -2.5, 0.0, 0.0], margin=0.1)
    # The second link's end is in the floor, and the first one's is not.
    expected = 0.5 + 0.4 * np.cos(2.3) + 0.3 * np.cos(2.6) - 0.05
    np.testing.assert_allclose([low, on_stand], expected, rtol=0, atol=1e-6)


def test_links_that_are_drawn_too_near_are_not_compared_and_others_of_them_are(tmp_path):
    near = '<geom type="sphere" size="{}" pos="0 0 {}"/>'
    plant = capsule_plant(tmp_path)
    text = BARE_ARM.format(flange=near.format(0.03, 0.0), floor="", name='name="b"')
    text = text.replace('<body name="a" pos="0 0 0.5">', f'<body name="a" pos="0 0 0.5">{near.format(0.8, 0.5)}', 1)
    text = text.replace('<body name="d"', f'{near.format(0.05, 0.0)}<body name="d"', 1)
    plant.robot.model.write_text(text)
    drawn = Clearance(plant, 0.2, [])
    # The ball about link a is wider than links c and e, which carry balls, can leave; c and e are neighbours but one.
    assert drawn.always_near == (("a", "e"),)
    assert drawn(np.zeros((1, 5)))[0] == 0.2
    plant.robot.model.write_text(text.replace('size="0.8"', 'size="0.5"'))  # link e can leave it, a little
    assert Clearance(plant, 0.2, []).always_near == (("a", "e"),)
    plant.robot.model.write_text(text.replace('size="0.8"', 'size="0.1"'))
    free = Clearance(plant, 0.2, [])
    assert free.always_near == ()
    np.testing.assert_allclose(
        free(np.array([[0.0, 0.0, np.pi, 0.0, 0.0]])), 0.02 - 0.1 - 0.03, atol=1e-6
    )  # of a and e


def test_the_capsule_of_a_turned_link_leads_from_its_joint_to_the_next_one(tmp_path):
    spec = mujoco.MjSpec.from_file(str(capsule_plant(tmp_path, name='name="b" euler="20 -50 70"').robot.model))
    assert add_capsules(spec, None) == ["a", "b", "d"]  # link c is 0.02 m long, and the last one ends at no joint
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = [0.3, -0.4, 0.7, 0.2, -0.6]
    mujoco.mj_kinematics(model, data)
    for geom, joint in enumerate((0, 1, 3)):
        along = model.geom_size[geom, 1] * data.geom_xmat[geom].reshape(3, 3)[:, 2]
        ends = sorted((data.geom_xpos[geom] + side * along).tolist() for side in (-1.0, 1.0))
        np.testing.assert_allclose(ends, sorted(data.xanchor[[joint, joint + 1]].tolist()), rtol=0, atol=1e-9)
