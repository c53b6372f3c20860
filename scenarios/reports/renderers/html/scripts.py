"""Content of `<script>` elements: text that cannot end the element, and Vega from vl-convert."""

import json
from functools import lru_cache


def script_json(value: object) -> str:
    """Return JSON without `<`, `>` and `&`, which are escaped in strings."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def script_code(code: str) -> str:
    """Return equivalent JavaScript without an end of a script element in strings."""
    return code.replace("</script", "<\\/script").replace("<!--", "<\\!--")


@lru_cache(maxsize=1)
def drawing_library() -> str:
    """Return a module that sets `window.vegaEmbed`, 0.9 MB; cached, as bundling takes one to three seconds."""
    import vl_convert

    return script_code(vl_convert.javascript_bundle("window.vegaEmbed = vegaEmbed;"))
