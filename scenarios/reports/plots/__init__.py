"""Figures of results, one module per result; only these modules import Matplotlib."""
