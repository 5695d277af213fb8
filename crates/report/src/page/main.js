// Draws every plot of the page where its data stand.

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
