"""What a page has inside a `<script>`: text that cannot end the element, and Vega, as vl-convert brings it."""

import json
from functools import lru_cache


def script_json(value: object) -> str:
    """JSON without any `<`, `>` or `&`, which its strings may have escaped."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def script_code(code: str) -> str:
    """JavaScript whose strings hold no end of a script element; what it does is the same."""
    return code.replace("</script", "<\\/script").replace("<!--", "<\\!--")


@lru_cache(maxsize=1)
def drawing_library() -> str:
    """A module that sets `window.vegaEmbed`; 0.9 MB. Bundled once a process: it takes a second or three."""
    import vl_convert

    return script_code(vl_convert.javascript_bundle("window.vegaEmbed = vegaEmbed;"))
