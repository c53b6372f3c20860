"""Identification of drive gains: recordings in, gains out. Needs NumPy, SciPy and Pinocchio; never a simulator.

    filter     `signals`         zero-phase low-pass of q, central differences
    regress    `regressor`       torque is linear in the standard parameters (eq. 9)
    decimate   `observation`     the same low-pass on currents and columns (eq. 15)
    base       `base`            independent columns (eq. 11), `structure` those that act on each joint
    solve      `least_squares`   with covariance (eq. 17 to 22)
    gains      `estimators`      from a `problem` to an `estimate`, `ls-2011` joint by joint (eq. 26 and 27)
    judge      `estimate`        refusals and signs of gains, `intervals` their covariance

`identify` runs all steps and checks the data for faults. The public names are exported here, listed in `__init__.pyi`,
and imported at first use. Equation numbers are those of M. Gautier and S. Briot, New
Method for Global Identification of the Joint Drive Gains of Robots using a Known Payload Mass, IROS 2011.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
