"""The simulated robot cell: a plant with known truth, a controller, sensors, and the recordings they leave."""
