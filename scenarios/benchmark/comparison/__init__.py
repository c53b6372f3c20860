"""Comparison of methods on the same recordings."""
