"""Declarative experiments: scenario files, the verdict on them, reports, and the command line `rx90`."""
