"""Identification of drive gains: recordings in, gains out. Needs NumPy, SciPy and Pinocchio; never a simulator.

    filter     `signals`         zero-phase low-pass of q, central differences
    regress    `regressor`       torque is linear in the standard parameters (eq. 9)
    decimate   `observation`     the same low-pass on currents and columns (eq. 15)
    base       `base`            independent columns (eq. 11), `structure` what each joint sees of them
    solve      `least_squares`   with covariance (eq. 17 to 22)
    gains      `gains`           joint by joint (eq. 26 and 27)

`identify.identify` runs them all and checks that the data are what they are said to be. Equation numbers are those
of M. Gautier and S. Briot, New Method for Global Identification of the Joint Drive Gains of Robots using a Known
Payload Mass, IROS 2011.
"""
