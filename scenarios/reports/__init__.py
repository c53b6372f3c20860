"""Reports of results: their content (`content`, one module per result) is separate from its rendering (`renderers`)."""
