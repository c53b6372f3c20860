"""From the linear systems of several motions to gains with their uncertainty: problem, methods, estimate.

It may know `observation` and what that stands on. Methods by name are in `estimators`; `joint_by_joint`, `homogeneous`
and `all_joints` hold what they are made of, `uncertainty` the covariances to choose from.
"""
