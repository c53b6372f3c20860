"""The commands of `rx90`: one file each, its arguments and its main."""
