"""Comparison of methods, and repetition of the published experiment.

It may import `experiments` and `results`.
"""
