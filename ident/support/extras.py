"""Packages that only some of what one can do needs: which extra of this project brings each."""

PROJECT = "rx90-drive-gain-testbench"
EXTRAS: dict[str, tuple[str, str]] = {
    "pyarrow": ("parquet", "Parquet files and --save"),
    "jinja2": ("pages", "pages"),
    "vl_convert": ("pages", "pages with plots"),
    "cma": ("study", "searches"),
    "filelock": ("study", "studies"),
    "matplotlib": ("study", "figures"),
    "pandas": ("study", "studies"),
    "rosbags": ("ros", "ROS 2 bags and MCAP files"),
    "imageio": ("film", "MP4"),
    "imageio_ffmpeg": ("film", "MP4"),
    "PIL": ("film", "pictures"),
    "distributed": ("cluster", "Dask"),
}
"""By the name that is imported: the extra, and what needs it."""


def needed_extra(package: str | None, wider: str | None = None) -> str | None:
    """What to say of a package that is not there, with the command that installs it; None where no extra brings it.

    Args:
        package: As it is imported, or a module of it.
        wider: Extra that brings it with all else that is needed, where that is known.
    """
    name = (package or "").partition(".")[0]
    if name not in EXTRAS:
        return None
    extra, what = EXTRAS[name]
    return f"{name} is not installed, which is needed for {what}: pip install '{PROJECT}[{wider or extra}]'"
