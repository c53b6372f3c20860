"""First-order prediction of the effect of a scenario's error sources, without simulation.

expected   the logs with perfect control, including effects of the plant
linear     an estimate from such logs, and its derivatives with respect to the currents
moments    mean and standard deviation of functions of a draw
predictor  error from each source, from one estimate
budget     errors from all sources
deviations standard deviations for a bare and a loaded motion, in a millisecond, for searches
"""
