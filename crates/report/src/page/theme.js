// Colours and type of the plots, from the page's style sheet; light or dark as the reader's system is.

const SERIES_COLOURS = 7;
const FONT = "12px system-ui, -apple-system, \"Segoe UI\", Roboto, \"Helvetica Neue\", Arial, \"Liberation Sans\", sans-serif";

const scheme = window.matchMedia("(prefers-color-scheme: dark)");
let styles = {};

/** The value of a custom property of the style sheet. */
function themed(name) {
  if (!(name in styles)) styles[name] = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return styles[name];
}

/** The colour of the series with this index within its plot. */
function seriesColour(index) {
  return themed(`--series-${index % SERIES_COLOURS}`);
}

/** The marks of a legend by the series' places; the style sheet's colours, so that they follow the scheme by themselves. */
const LEGEND_MARKS = { width: 0, fill: (u, index) => `var(--series-${(index - 1) % SERIES_COLOURS})` };

const LEVELS = ["neutral", "normal", "attention", "fault"];

/** Calls back after the colours have changed, on paper too. */
function onTheme(redraw) {
  const changed = () => { styles = {}; redraw(); };
  scheme.addEventListener("change", changed);
  window.addEventListener("beforeprint", changed);
  window.addEventListener("afterprint", changed);
}

/** An axis of uPlot in the page's style. */
function styledAxis(options) {
  return Object.assign({
    stroke: () => themed("--muted"),
    font: FONT,
    labelFont: FONT,
    grid: { stroke: () => themed("--grid"), width: 1 },
    ticks: { stroke: () => themed("--grid"), width: 1, size: 4 },
    gap: 4,
  }, options);
}

/** An element with a class and, if given, text. */
function element(tag, className, text) {
  const made = document.createElement(tag);
  made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

/** Calls back with the element's width, now and whenever it changes; not while it is folded away. */
function onWidth(place, resized) {
  let last = 0;
  const observer = new ResizeObserver(() => {
    const width = Math.floor(place.clientWidth);
    if (width > 0 && width !== last) resized(last = width);
  });
  observer.observe(place);
}
