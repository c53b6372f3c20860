"""Designing an experiment before it is made."""
