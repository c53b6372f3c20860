"""Recordings: what a robot's controller logged of one motion, and what was mounted; their files and clocks.

It may know `payload`. Every log format has a file in `formats`.
"""
