"""From a recording to linear systems: filtering, differentiation, masking of velocity reversals, decimation.

It may import `model`, `recordings` and `numerics`.
"""
