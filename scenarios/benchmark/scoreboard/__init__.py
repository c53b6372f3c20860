"""Methods on public recordings of real robots, which a user has downloaded: no data are in this project.

recipes    what to download, how it is read, what is known of the gains
board      every recipe whose files are there, through every method
results    what came out
"""
