// Draws every plot of the page where its data stand.

/** Calls back with the element's width, now and whenever it changes; not while it is folded away. */
function onWidth(place, resized) {
  let last = 0;
  const observer = new ResizeObserver(() => {
    const width = Math.floor(place.clientWidth);
    if (width > 0 && width !== last) resized(last = width);
  });
  observer.observe(place);
}

const KINDS = { time: TimePlots, xy: XyPlot, linked: Linked };
const plots = [];

for (const figure of document.querySelectorAll("figure.plot")) {
  const data = figure.querySelector("script");
  const spec = JSON.parse(data.textContent);
  data.remove();
  plots.push(new KINDS[spec.kind](figure, spec));
}

for (const table of document.querySelectorAll("table.opening")) new OpeningTable(table);

/** For whoever looks at the page from outside: the plots, as drawn. */
window.reportPlots = plots;
