const plots = JSON.parse(document.getElementById("plots").textContent);
const views = new Array(plots.length);
const rows = (s) => s.x.map((x, i) => ({ x, y: s.y?.[i], low: s.low?.[i], high: s.high?.[i] }));
const started = performance.now();

const canvas = (k) => document.getElementById("canvas" + k);
const along = ([a, b], [c, d]) => Math.min(b, d) - Math.max(a, c) > 0.5 * Math.max(b - a, d - c); // of one clock
let linking = false, wanted = null;

async function draw(k) {
  if (views[k]) return;
  views[k] = true;
  const plot = plots[k], place = canvas(k);
  for (const source of plot.vega.data) if (plot.data[source.name]) source.values = rows(plot.data[source.name]);
  const { view } = await vegaEmbed(place, plot.vega, { mode: "vega", renderer: "svg", actions: false, hover: false });
  views[k] = view;
  if (plot.zoom) {
    plot.all = view.scale("x").domain().map(Number);
    view.addSignalListener("zoom_x", (_, seen) => { place.dataset.seen = seen; link(k, seen); });
  }
  place.style.minHeight = "0";
  place.closest(".plot").dataset.drawn = "yes";
  if (!document.documentElement.dataset.first) document.documentElement.dataset.first = performance.now() - started;
}

async function link(k, seen) { // plots along one time show the same part of it
  if (!seen || (linking && wanted.k !== k)) return; // as told by this very function
  wanted = { k, seen };
  if (linking) return;
  linking = true;
  for (let now = null; now !== wanted;) {
    now = wanted;
    const others = [...plots.keys()].filter((other) => other !== k && plots[other].all && along(plots[k].all, plots[other].all));
    await Promise.all(others.map((other) => views[other].signal("zoom_x", now.seen).runAsync()));
  }
  linking = false;
}

const near = new IntersectionObserver((seen) => seen.forEach((each) => {
  if (each.isIntersecting) { near.unobserve(each.target); draw(+each.target.id.slice(6)); }
}), { rootMargin: "200px" });
document.querySelectorAll(".canvas").forEach((place) => near.observe(place));

async function drawAll() {
  for (let k = 0; k < plots.length; k++) {
    await draw(k);
    await new Promise((rest) => setTimeout(rest, 0));
  }
  document.documentElement.dataset.drawn = "all";
  document.documentElement.dataset.drawnAfter = performance.now() - started;
}
requestAnimationFrame(() => setTimeout(drawAll, 0));

function zoom(k, how) {
  const view = views[k];
  if (!view?.scale) return;
  if (how === "all") { view.signal("zoom_x", plots[k].all).run(); return; }
  const [a, b] = view.scale("x").domain().map(Number), span = b - a;
  const [left, right] = { in: [0.25, -0.25], out: [-0.5, 0.5], left: [-0.25, -0.25], right: [0.25, 0.25] }[how];
  view.signal("zoom_x", [a + left * span, b + right * span]).run();
}

function table(k) {
  const plot = plots[k], made = document.createElement("table"), head = made.createTHead().insertRow(), body = made.createTBody();
  const cell = (row, text, kind = "td") => row.appendChild(Object.assign(document.createElement(kind), { textContent: text ?? "" }));
  const ends = plot.labels.some((_, s) => plot.data["s" + s].low);
  for (const name of ["series", plot.x, plot.y, ...(ends ? ["from", "to"] : [])]) cell(head, name, "th").scope = "col";
  plot.labels.forEach((label, s) => rows(plot.data["s" + s]).forEach((each) => {
    if (each.x === null || each.y === null) return;
    const row = body.insertRow();
    cell(row, label);
    cell(row, each.x);
    cell(row, each.y);
    if (ends) { cell(row, each.low); cell(row, each.high); }
  }));
  return made;
}

document.querySelectorAll(".plot").forEach((figure) => {
  const own = [...figure.querySelectorAll(".canvas")].map((place) => +place.id.slice(6)), numbers = figure.querySelector(".numbers");
  figure.querySelectorAll("button").forEach((button) => button.addEventListener("click", () => zoom(own[0], button.dataset.do)));
  figure.querySelector("details").addEventListener("toggle", () => { if (!numbers.firstChild) numbers.append(...own.map(table)); });
});

const SMALLER = 1.45; // on paper a plot is drawn wider than its place and shrunk, so that its letters fit those around it
function fit(paper, among = document) {
  among.querySelectorAll(".canvas").forEach((place) => {
    const view = views[+place.id.slice(6)], width = place.clientWidth;
    if (view?.width && width) view.signal("width", width * (paper ? SMALLER : 1)).run();
  });
}
document.querySelectorAll("details.section").forEach((section) => section.addEventListener("toggle", () => fit(false, section)));
window.matchMedia("print").addEventListener("change", (each) => fit(each.matches));
window.addEventListener("beforeprint", () => fit(true));
window.addEventListener("afterprint", () => fit(false));
