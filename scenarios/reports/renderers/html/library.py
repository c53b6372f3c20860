"""Vega, the library that draws the plots of a page, as the wheel of vl-convert brings it."""

from functools import lru_cache

from scenarios.reports.renderers.html.scripts import script_code


@lru_cache(maxsize=1)
def drawing_library() -> str:
    """A module that sets `window.vegaEmbed`; 0.9 MB. Bundled once a process: it takes a second or three."""
    import vl_convert

    return script_code(vl_convert.javascript_bundle("window.vegaEmbed = vegaEmbed;"))
