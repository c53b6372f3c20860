"""Recordings of one motion by a robot's controller, with payloads; their files and clocks.

It may import `payload`. Every log format has a file in `formats`.
"""
