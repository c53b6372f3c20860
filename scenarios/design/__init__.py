"""Design of experiments: motions, payloads, robot files."""
