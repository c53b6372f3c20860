"""Seeds of trials: whole numbers from 0."""

SEEDS = 2**31
"""Seeds end before this."""
