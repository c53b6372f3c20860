"""What a scenario's errors cost, predicted to first order: nothing is simulated.

expected   the logs of perfect control, with whatever the plant has
linear     an estimate from such logs, and what a change or noise of any current does to each gain
moments    mean and deviation of what follows a draw
predictor  each source, from one estimate
budget     all of them
deviations of a bare and a loaded motion, in a millisecond: what motions and payloads are searched by
"""
