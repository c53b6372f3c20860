"""Methods on public recordings of real robots, which a user has downloaded; this project contains no recordings.

recipes    what to download, how to read it, published gains
board      runs every method on every recipe whose files exist
results    models of the results
"""
