"""Payloads as specified by the user, and payload files.

It may import `model`, for the order of inertial parameters.
"""
