"""Common parts of commands: types of arguments, groups of options, output, progress, exit statuses.

It may import everything but `commands`.
"""
