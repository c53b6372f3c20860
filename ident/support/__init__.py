"""What every part needs and none is about: errors, arrays, options, names in messages, files of bounded size.

It knows nothing of robots, and imports nothing of the other folders.
"""
