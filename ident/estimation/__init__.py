"""From the linear systems of several motions to gains with their uncertainty: problem, methods, estimate.

It may import `observation` and what that imports. `estimators` has the methods by name; `joint_by_joint`
and `all_joints` have their parts, `intervals` the covariances to choose from.
"""

import lazy_loader
import numpy as np

for _name in ("f2py", "testing"):  # SciPy imports every subpackage of NumPy; these two take .05 s and are never used
    setattr(np, _name, lazy_loader.load(f"numpy.{_name}", suppress_warning=True))
