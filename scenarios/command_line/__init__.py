"""What commands share: types of arguments, groups of options, output, progress, exit statuses.

It may know everything but `commands`.
"""
