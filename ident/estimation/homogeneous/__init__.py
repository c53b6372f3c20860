"""All joints at once, in torque units: gains are unknowns beside the arm's parameters, the known payload is given.

V_j g_j - A_j theta - F_j phi_j = k_j

V_j          currents of joint j [drive units]
A_j, theta   columns and values of what joints share [SI]
F_j, phi_j   columns of the joint's own friction and offset, and their values [N m, ...]
k_j          torque of the known payload parameters [N m]

The currents, the only noisy part, stand among the columns, so that no method on this form is free of bias.

system       the stacked equations
weights      how rows of different joints count
null_vector  its solution by total least squares
solved       from its unknowns to gains, with the influence of each row
bias         what current noise does to ordinary least squares
"""
