"""The arm: its kinematics from a model file, its regressor, its base parameters, its inverse dynamics.

It may import `support`. Model files are read in `files`.
"""
