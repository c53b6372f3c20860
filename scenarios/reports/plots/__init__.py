"""Pictures of results, one module a result; Matplotlib is imported here alone."""
