"""First-order prediction of the effect of a scenario's error sources, without simulation."""
