"""From the linear systems of several motions to gains with their uncertainty: problem, methods, estimate.

It may import `observation` and what that imports. `estimators` has the methods by name; `joint_by_joint`
and `all_joints` have their parts, `intervals` the covariances to choose from.
"""
