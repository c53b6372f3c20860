"""Text that is safe inside a `<script>`: nothing in it can end the element or begin a comment."""

import json


def script_json(value: object) -> str:
    """JSON without any `<`, `>` or `&`, which its strings may have escaped."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def script_code(code: str) -> str:
    """JavaScript whose strings hold no end of a script element; what it does is the same."""
    return code.replace("</script", "<\\/script").replace("<!--", "<\\!--")
