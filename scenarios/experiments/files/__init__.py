"""Scenario files: TOML in, validated values out."""
