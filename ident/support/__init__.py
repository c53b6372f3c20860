"""General support: errors, arrays, options, names in messages, files of bounded size.

It imports nothing from the other folders.
"""
