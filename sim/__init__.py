"""The simulated robot cell: a plant with known parameters, a controller, sensors, and the resulting recordings."""
