"""All joints at once, in current units: common link parameters, friction of each joint, logarithmic gains.

V_j = h_j (A_j theta + k_j) + F_j phi_j + e_j        h_j = 1 / g_j

A_j, theta   columns and values of what joints share: the arm's base parameters without friction and offset, and the
unknown parameters of each mounting [SI]
k_j          torque of the known payload parameters [N m]
F_j, phi_j   columns of the joint's own friction and offset, and their values in drive units

columns      what V, A, k and F are, from a problem
friction     the columns of F, one choice a joint
reduction    each joint's rows as few as its columns, exactly
start        where the search begins: signs by friction, sizes joint by joint
search       the logarithms of the gains, by damped Newton steps
fit          what was found, linearised: influence of each row, what the unknowns can explain
"""
