"""First-order prediction of the effect of a scenario's error sources, without simulation.

predictor   errors from each source, from one linearised estimate of expected logs
budget      errors from all sources, the result of `rx90 predict`
deviations  standard deviations for a bare and a loaded motion, in a millisecond, for designs
sources_along   errors from sources along any motion, for designs
moments     mean and standard deviation of functions of a draw
"""
