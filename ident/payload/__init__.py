"""Payloads as stated by the user, and payload files.

It may import `model`, for the order of inertial parameters.
"""
