"""Methods held against each other, and the published experiment repeated.

It may know `experiments` and `results`.
"""
