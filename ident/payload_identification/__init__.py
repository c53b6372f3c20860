"""Identification of payloads from currents with known drive gains (paper, eq. 25).

payload_estimate    all ten parameters from all joints, with the model of `nls` and fixed gains
payload_body        mass, centre and inertia of these parameters
mass_by_joint       the mass from each joint alone
verification        comparison of estimated and weighed mass
common_scale        comparison of the joints' estimates
gains_outcome       payload and arm estimated with given gains
payload_parameters  the paper's own least squares of rows of all joints
"""
