"""Result folders, and models of results."""
