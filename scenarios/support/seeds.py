"""Seeds of trials: whole numbers from 0."""

SEEDS = 2**31
"""Upper bound of seeds, exclusive."""
