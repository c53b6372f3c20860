"""Studies: thousands of trials of one scenario."""
