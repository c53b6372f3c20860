"""From what was identified to a patched copy of a model file: values, places in the file, edits of its text."""
