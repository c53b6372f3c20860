"""Parameters of arm and payload with given gains, and what they say of the gains.

arm       ratios of gains, base parameters and friction from bare motions
links     physically consistent links with these base parameters
payload   a payload from currents, its mass, centre and inertia; the paper's own least squares (eq. 25)
weighing  gains tested with a weighed payload: mass from all joints and from each alone
"""
