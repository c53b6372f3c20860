"""A payload as its user weighed and drew it, and the file that says so.

It may know `model`, for the order of inertial parameters.
"""
