"""Gains in use: what a gains file and recordings make of each other."""
