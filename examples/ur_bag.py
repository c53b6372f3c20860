"""ROS 2 bags as a UR's driver fills them with `use_currents_as_efforts:=true`, of recordings that are there.

    python ur_bag.py arm.urdf bare.csv heavy.csv

writes the folders `bare` and `heavy`: /joint_states, joints in alphabetical order, effort in amperes. Needs `rosbags`.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore

from ident import load_arm, read_recording

STORE = get_typestore(Stores.ROS2_JAZZY)
KIND = "sensor_msgs/msg/JointState"


def main(words: Sequence[str]) -> None:
    """Write a bag of each recording; `words` are the arm's model and the recordings."""
    names = load_arm(words[0]).joint_names
    order = np.argsort(names)
    Time, Header = STORE.types["builtin_interfaces/msg/Time"], STORE.types["std_msgs/msg/Header"]
    for path in map(Path, words[1:]):
        log = read_recording(path)
        with Writer(path.with_suffix(""), version=9) as bag:
            topic = bag.add_connection("/joint_states", KIND, typestore=STORE)
            for t, q, v in zip(log.t, log.q, log.v, strict=True):
                ns = round(1e9 * t)
                state = STORE.types[KIND](
                    header=Header(stamp=Time(sec=ns // 10**9, nanosec=ns % 10**9), frame_id="base_link"),
                    name=[names[j] for j in order],
                    position=q[order],
                    velocity=np.zeros(len(q)),
                    effort=v[order],
                )
                bag.write(topic, ns, STORE.serialize_cdr(state, KIND))


if __name__ == "__main__":
    main(sys.argv[1:])
