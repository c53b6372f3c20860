"""One joint's gain from its own rows (paper, eq. 27): what the methods that solve joint by joint share."""
