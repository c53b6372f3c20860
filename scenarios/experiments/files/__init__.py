"""Scenario files: from TOML to validated values."""
