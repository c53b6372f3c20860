"""What motions show of the arm itself: bare motions, parameters with deviations, links that bodies can have.

It may know `estimation`.
"""
