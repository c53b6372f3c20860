"""From identified values to a patched copy of a model file: values, positions in the file, edits of its text."""
