"""Where trials run, and what happens when a place to run them dies."""
