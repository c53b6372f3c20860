"""Faults of logs and estimates, by comparing how well alternative interpretations of the logs predict the currents."""
