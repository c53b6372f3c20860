"""From a recording to linear systems: filtered, differentiated, cleared of velocity reversals, decimated.

It may know `model`, `recordings` and `numerics`.
"""
