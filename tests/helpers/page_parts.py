"""What tests of pages share: the elements of a page, a gain to be shown."""

from html.parser import HTMLParser

from ident.estimation.estimate import IdentifiedGain


class Elements(HTMLParser):
    """Elements of a page by name, and all its text outside scripts and styles."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.inside = ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        self.inside = tag

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        if self.inside not in ("script", "style"):
            self.text += data

    def count(self, tag: str) -> int:
        return sum(name == tag for name, _ in self.found)


def identified(value: float, std: float, payload: float = 0.0, model: float = 0.0) -> IdentifiedGain:
    return IdentifiedGain(
        joint="j",
        value=value,
        residual_std=std,
        payload_rel_std=payload,
        model_rel_std=model,
        predicted_rel_std=std / abs(value),
    )


def drawn_intervals(axes) -> list[dict[int, tuple[float, float, float]]]:
    """Value, lower and upper end of joints, by their labels on the x axis, of every series of intervals."""
    names = [int(each.get_text()) for each in axes.get_xticklabels()]
    found = []
    for line, rules in zip(axes.lines, axes.collections, strict=False):
        ends = [segment[:, 1].tolist() for segment in rules.get_segments()]
        values = line.get_xydata().tolist()
        found.append({names[round(at)]: (y, *own) for (at, y), own in zip(values, ends, strict=True)})
    return found
