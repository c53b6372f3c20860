"""Judging a log before anything is identified: what it looks like, and whether it is of the arm as modelled."""
