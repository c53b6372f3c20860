"""Payloads from currents, the drive gains known (paper, eq. 25).

payload_estimate    all ten parameters from all joints, in the model that `nls` has of an arm, gains held
payload_body        mass, centre and inertia of these parameters
mass_by_joint       the mass from each joint alone
verification        a mass found against the scale
common_scale        joints against each other, beside a scale or without
gains_outcome       what believed gains make of a weight and of the arm
payload_parameters  the paper's own least squares of rows of all joints
"""
