// The same samples over several quantities: what is selected in one plot lights up in all, and in the tables of runs.

/** One of the plots: a drag selects samples instead of a part to see. */
class LinkedPlot extends XyPlot {
  constructor(figure, spec, owner) {
    super(figure, spec);
    this.owner = owner;
  }

  drag() { return { setScale: false }; }

  hooks() { return { setSelect: [(u) => this.selected(u)] }; }

  selected(u) {
    const { left, top, width, height } = u.select;
    if (width <= 0 || height <= 0) return;
    const x = [u.posToVal(left, "x"), u.posToVal(left + width, "x")];
    const y = [u.posToVal(top + height, "y"), u.posToVal(top, "y")];
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    const seen = this.series.filter((series, index) => u.series[index + 1].show);
    this.owner.select((sample) => this.series[0].x[sample] >= x[0] && this.series[0].x[sample] <= x[1]
      && seen.some((series) => series.y[sample] >= y[0] && series.y[sample] <= y[1]));
  }

  whole(u) {
    if (this.owner.chosen) this.owner.clear(); else super.whole(u);
  }

  points(u, series) {
    const { chosen } = this.owner;
    if (!chosen) return super.points(u, series);
    const of = (keep) => ({
      ...series,
      x: series.x.map((value, sample) => (chosen[sample] === keep ? value : NaN)),
    });
    const { ctx } = u, strong = ctx.fillStyle;
    ctx.fillStyle = themed("--unlit");
    super.points(u, of(0));
    ctx.fillStyle = strong;
    super.points(u, of(1));
  }
}

class Linked {
  constructor(figure, spec) {
    this.spec = spec;
    this.group = decode(spec.group, Float32Array);
    this.series = spec.series.map((series) => ({ ...series, y: Float64Array.from(decode(series.values, Float32Array)) }));
    this.chosen = null;
    this.bar = element("div", "toolbar picker");
    this.said = element("p", "note selected", "Drag over samples to see them in all plots; a double click lets them go.");
    this.said.setAttribute("role", "status");
    this.place = element("div", "beside");
    figure.prepend(this.bar, this.said, this.place);
    this.bar.append(element("span", "", "Over:"));
    this.plots = spec.covariates.map((covariate) => this.offer(covariate));
  }

  /** A button for a quantity, which shows and hides its plot. */
  offer(covariate) {
    const { label } = covariate.axis;
    const button = element("button", "", label), figure = element("figure", "plot");
    const state = { label, button, figure, drawn: null };
    const show = (on) => {
      button.setAttribute("aria-pressed", String(on));
      figure.hidden = !on;
      if (on && !state.drawn) state.drawn = this.draw(figure, covariate);
    };
    button.type = "button";
    button.addEventListener("click", () => show(figure.hidden));
    this.bar.append(button);
    this.place.append(figure);
    show(covariate.shown);
    return state;
  }

  draw(figure, covariate) {
    const x = Float64Array.from(decode(covariate.values, Float32Array));
    const series = this.series.map((of) => ({ name: of.name, hue: of.hue, style: "points", x, y: of.y }));
    const { y, view } = this.spec;
    return new LinkedPlot(figure, { title: covariate.axis.label, x: covariate.axis, y, view, series }, this);
  }

  select(inside) {
    this.chosen = Uint8Array.from(this.group, (group, sample) => (inside(sample) ? 1 : 0));
    const counts = new Map();
    this.group.forEach((group, sample) => {
      if (this.chosen[sample]) counts.set(group, (counts.get(group) || 0) + 1);
    });
    const runs = [...counts].sort((a, b) => b[1] - a[1]);
    const all = runs.reduce((sum, [, count]) => sum + count, 0);
    const named = runs.slice(0, 8).map(([group, count]) => `${this.spec.groups[group]} (${grouped(count)})`);
    const more = runs.length > 8 ? `, and ${runs.length - 8} more` : "";
    this.said.textContent = all
      ? `${grouped(all)} of ${grouped(this.group.length)} samples selected, in ${named.join(", ")}${more}.`
      : "No sample lies there.";
    if (!all) this.chosen = null;
    lightUp(all ? new Set(runs.map(([group]) => this.spec.groups[group])) : null);
    this.redraw();
  }

  clear() {
    this.chosen = null;
    this.said.textContent = "Drag over samples to see them in all plots; a double click lets them go.";
    lightUp(null);
    this.redraw();
  }

  redraw() {
    for (const { drawn } of this.plots) if (drawn && drawn.plot) drawn.plot.redraw(false);
  }
}
