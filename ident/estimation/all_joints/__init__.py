"""All joints at once, in current units: common link parameters, friction of each joint, logarithmic gains.

V_j = h_j (A_j theta + k_j) + F_j phi_j + e_j        h_j = 1 / g_j

A_j, theta   columns and values of the shared parameters: the arm's base parameters without friction and offset, and the
unknown parameters of each mounting [SI]
k_j          torque of the known payload parameters [N m]
F_j, phi_j   columns of the joint's own friction and offset, and their values in drive units

columns      V, A, k and F of a problem
friction     the columns of F, selected for each joint
reduction    each joint's rows reduced to as many as its columns, without loss
start        initial gains: signs by friction, magnitudes joint by joint
search       logarithmic gains by damped Newton steps
fit          the linearised result: influence of each row, basis of the column space
"""
