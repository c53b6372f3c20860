"""Folders that results are kept in, and read back from."""
