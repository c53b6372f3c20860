"""Parameters of the arm: from bare motions, with standard deviations, and as physically consistent links.

It may import `estimation`.
"""
