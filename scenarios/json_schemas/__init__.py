"""JSON Schema of the files that users write and read and of what commands print; `make schemas` writes them.

It may know everything that has a file or a JSON object; nothing imports it.
"""
