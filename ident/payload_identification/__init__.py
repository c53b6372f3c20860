"""Payloads from currents, the drive gains known (paper, eq. 25).

together      all ten parameters from all joints, in the model that `nls` has of an arm, gains held
body          mass, centre and inertia of these parameters
alone         the mass from each joint alone
verification  a mass found against the scale
accord        joints against each other, where there is no scale
"""
