"""Use of gains: verification, payloads, torques, comparison and model updates."""
