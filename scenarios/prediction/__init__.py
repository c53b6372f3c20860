"""What a scenario's errors cost, predicted to first order: nothing is simulated.

expected   the logs of perfect control, with whatever the plant has
linear     an estimate from such logs, and what a change of any current does to each gain
noise      standard deviations from the spectrum of each noise
moments    mean and deviations of what a scenario draws
predictor  each source, from one estimate
budget     all of them
"""
