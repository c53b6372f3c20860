"""Optional packages, and the extras of this project that install them."""

PROJECT = "rx90-drive-gain-testbench"
EXTRAS: dict[str, tuple[str, str]] = {
    "pyarrow": ("parquet", "Parquet files and --save"),
    "jinja2": ("pages", "pages"),
    "cma": ("study", "searches"),
    "filelock": ("study", "studies"),
    "matplotlib": ("study", "figures"),
    "pandas": ("study", "studies"),
    "rosbags": ("ros", "ROS 2 bags and MCAP files"),
    "imageio": ("film", "MP4"),
    "imageio_ffmpeg": ("film", "MP4"),
    "PIL": ("film", "pictures"),
    "OpenGL": ("film", "pictures"),
    "glfw": ("film", "windows"),
    "distributed": ("cluster", "Dask"),
}
"""By import name: the extra, and its use."""


def needed_extra(package: str | None, wider: str | None = None) -> str | None:
    """Return the message for a missing package, with the command that installs it; None if it is not in an extra.

    Args:
        package: Import name of the package or of one of its modules.
        wider: Extra that includes it and all other required packages, if known.
    """
    name = (package or "").partition(".")[0]
    if name not in EXTRAS:
        return None
    extra, what = EXTRAS[name]
    return f"{name} is not installed, which is needed for {what}: pip install '{PROJECT}[{wider or extra}]'"
