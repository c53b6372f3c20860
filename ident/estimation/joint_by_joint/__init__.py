"""One joint's gain from its own rows (paper, eq. 27): common parts of the joint-by-joint methods."""
