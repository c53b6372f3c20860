"""Studies: thousands of trials of one scenario, on any executor, in a folder that survives being killed."""
