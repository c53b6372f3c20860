"""General support: errors, progress on a terminal, versions, import path.

It may not import other folders of this package.
"""
