"""Gautier and Briot (2011), section IV, on the simulated robot."""
