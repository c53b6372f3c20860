"""What every part needs and none is about: errors, progress on a terminal, versions, the import path.

It may know nothing else of this package.
"""
