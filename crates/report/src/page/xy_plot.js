// y over x: lines, points and histograms' steps, on linear or logarithmic axes.

const XY_HEIGHT = 300;
const REACH_PX = 24;

class XyPlot {
  constructor(figure, spec) {
    this.spec = spec;
    this.series = spec.series.map((series) => ({
      ...series,
      x: typeof series.x === "string" ? decode(series.x, Float64Array) : series.x,
      y: typeof series.y === "string" ? decode(series.y, Float64Array) : series.y,
    }));
    this.full = { x: this.range("x", this.series), y: this.range("y", this.series) };
    // At first without what would flatten all the rest.
    this.first = { x: this.full.x, y: spec.view ? roomy(...spec.view) : this.full.y };
    this.head = element("div", "plot-head");
    this.head.append(element("span", "plot-title", spec.title));
    this.place = element("div", "canvas");
    figure.prepend(this.head, this.place);
    if (this.series.every((series) => series.y.length === 0)) {
      this.place.append(element("p", "note", "No values."));
      return;
    }
    onWidth(this.place, (width) => this.resize(width));
  }

  resize(width) {
    if (this.plot) this.plot.setSize({ width, height: XY_HEIGHT });
    else this.plot = this.draw(width);
  }

  /** The range of a whole axis, for some of the series. */
  range(key, shown) {
    const log = this.spec[key].log;
    const spans = shown.map((series) => extent(log ? series[key].filter((v) => v > 0) : series[key]));
    const low = Math.min(...spans.filter(Boolean).map((span) => span[0]));
    const high = Math.max(...spans.filter(Boolean).map((span) => span[1]));
    const steps = shown.some((series) => series.style === "steps");
    if (!(low <= high)) return log ? [1, 10] : [0, 1];
    if (steps && key === "y") return [0.5, Math.max(10, high * 1.6)];
    if (!log) return roomy(low, high);
    const room = low < high ? (high / low) ** 0.04 : 2;
    return [low / room, high * room];
  }

  draw(width) {
    const scale = (key) => ({
      time: false, auto: false, distr: this.spec[key].log ? 3 : 1,
      min: this.first[key][0], max: this.first[key][1], range: (u, low, high) => [low, high],
    });
    const plot = new uPlot({
      mode: 2, width, height: XY_HEIGHT, padding: [10, 16, 0, 0],
      legend: { markers: this.marks(), mount: (u, legend) => this.head.append(legend) },
      cursor: {
        drag: { x: true, y: true, uni: 30, dist: 5, ...this.drag() },
        dataIdx: (u, index) => this.nearest(u, index),
        points: { show: this.series.every((series) => series.style !== "steps"), size: 7 },
        bind: { dblclick: (u) => () => { this.whole(u); return null; } },
      },
      scales: { x: scale("x"), y: scale("y") },
      axes: [this.axis("x", { size: 30 }), this.axis("y", { size: 56 })],
      series: [null, ...this.series.map((series, index) => this.drawn(series, index))],
      hooks: { setSeries: [(u, index, { show }) => { if (show !== undefined) this.toggled(u); }], drawClear: [(u) => this.paintBands(u)], draw: [(u) => this.paint(u)], ...this.hooks() },
    }, [null, ...this.series.map((series) => [series.x, series.y])], this.place);
    onTheme(() => plot.redraw());
    return plot;
  }

  /** A series is hidden or shown: the axis goes by what is left, so that a small one isn't flattened by a large one. */
  toggled(u) {
    const shown = this.series.filter((series, index) => u.series[index + 1].show);
    const all = shown.length === this.series.length;
    const [min, max] = all || !shown.length ? this.first.y : this.range("y", shown);
    u.setScale("y", { min, max });
  }

  /** What drags do beside selecting a part to see. */
  drag() { return {}; }

  /** What else is to be told of. */
  hooks() { return {}; }

  colour(index) {
    const { hue } = this.series[index];
    return hue ? themed(`--hue-${hue}`) : seriesColour(index);
  }

  /** The marks of the legend; the style sheet's colours, so that they follow the scheme by themselves. */
  marks() {
    const variable = (index) => this.series[index]?.hue ? `--hue-${this.series[index].hue}` : `--series-${index % SERIES_COLOURS}`;
    return { width: 0, fill: (u, index) => `var(${variable(index - 1)})` };
  }

  axis(key, options) {
    const { label, unit, log } = this.spec[key];
    const text = unit ? `${label} (${unit})` : label;
    const values = (u, splits, axis, space, step) =>
      splits.map((value) => (value === null ? "" : log ? logTick(value) : tick(value, step)));
    const marks = { splits: (u) => logSplits(u.scales[key].min, u.scales[key].max), filter: (u, splits) => splits };
    return styledAxis({ ...(log ? marks : {}), scale: key, label: text, labelSize: 20, values, ...options });
  }

  drawn(series, index) {
    return {
      label: series.name,
      stroke: () => this.colour(index),
      fill: () => this.colour(index),
      facets: [{ scale: "x", auto: false }, { scale: "y", auto: false }],
      paths: () => null,
      points: { show: false },
      value: (u, value, seriesIndex, point) => (point === null || point === undefined ? "" : this.value(u, series, point)),
    };
  }

  value(u, series, point) {
    const x = (value) => reading(value, u.scales.x.max - u.scales.x.min);
    const { x: { unit }, y } = this.spec;
    if (series.style === "steps") {
      return `${grouped(series.y[point])} in ${x(series.x[point])}\u2009\u2026\u2009${x(series.x[point + 1])} ${unit}`;
    }
    const value = reading(series.y[point], u.scales.y.max - u.scales.y.min);
    return `${value} ${y.unit} at ${x(series.x[point])} ${unit}`;
  }

  /** The point of a series under the cursor: the nearest, or the bin that holds it. */
  nearest(u, index) {
    const series = this.series[index - 1];
    if (!series || u.cursor.left < 0) return null;
    if (series.style === "steps") {
      const bin = lowerBound(series.x, u.posToVal(u.cursor.left, "x")) - 1;
      return bin >= 0 && bin < series.y.length ? bin : null;
    }
    let best = null, least = REACH_PX ** 2;
    for (let i = 0; i < series.x.length; i++) {
      const dx = u.valToPos(series.x[i], "x") - u.cursor.left, dy = u.valToPos(series.y[i], "y") - u.cursor.top;
      const distance = dx * dx + dy * dy;
      if (distance < least) { best = i; least = distance; }
    }
    return best;
  }

  /** What was seen at first; all that there is where that is seen already. */
  whole(u) {
    const seen = (key) => u.scales[key].min === this.first[key][0] && u.scales[key].max === this.first[key][1];
    const to = seen("x") && seen("y") ? this.full : this.first;
    u.batch(() => {
      for (const key of ["x", "y"]) u.setScale(key, { min: to[key][0], max: to[key][1] });
    });
  }

  /** Parts of the x axis that stand out. */
  paintBands(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.font = FONT.replace("12px", `${11 * uPlot.pxRatio}px`);
    ctx.textBaseline = "top";
    for (const { from, to, label } of this.spec.bands || []) {
      const left = Math.max(bbox.left, u.valToPos(from, "x", true));
      const right = Math.min(bbox.left + bbox.width, u.valToPos(to, "x", true));
      if (!(right > left)) continue;
      ctx.fillStyle = themed("--band");
      ctx.fillRect(left, bbox.top, right - left, bbox.height);
      if (ctx.measureText(label).width > right - left - 4) continue;
      ctx.fillStyle = themed("--muted");
      ctx.fillText(label, left + 3 * uPlot.pxRatio, bbox.top + 2 * uPlot.pxRatio);
    }
    ctx.restore();
  }

  paint(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    this.series.forEach((series, index) => {
      if (!u.series[index + 1].show) return;
      ctx.strokeStyle = ctx.fillStyle = this.colour(index);
      ctx.lineWidth = 1.5 * uPlot.pxRatio;
      ctx.lineJoin = "round";
      if (series.style === "steps") this.steps(u, series);
      if (series.style === "line" || series.style === "both") this.line(u, series);
      if (series.style === "points" || series.style === "both") this.points(u, series);
    });
    ctx.restore();
  }

  line(u, { x, y }) {
    u.ctx.beginPath();
    let down = false;
    for (let i = 0; i < x.length; i++) {
      const px = u.valToPos(x[i], "x", true), py = u.valToPos(y[i], "y", true);
      if (Number.isFinite(px) && Number.isFinite(py)) {
        if (down) u.ctx.lineTo(px, py); else u.ctx.moveTo(px, py);
        down = true;
      } else {
        down = false;
      }
    }
    u.ctx.stroke();
  }

  points(u, { x, y }) {
    const size = (x.length > 2000 ? 2 : x.length > 300 ? 3.5 : 5) * uPlot.pxRatio;
    u.ctx.globalAlpha = x.length > 2000 ? 0.6 : 1;
    u.ctx.beginPath();
    for (let i = 0; i < x.length; i++) {
      const px = u.valToPos(x[i], "x", true), py = u.valToPos(y[i], "y", true);
      if (!Number.isFinite(px) || !Number.isFinite(py)) continue;
      u.ctx.moveTo(px + size / 2, py);
      u.ctx.arc(px, py, size / 2, 0, 2 * Math.PI);
    }
    u.ctx.fill();
    u.ctx.globalAlpha = 1;
  }

  steps(u, { x, y }) {
    const floor = u.valToPos(this.full.y[0], "y", true);
    const top = (count) => (count > 0 ? Math.min(u.valToPos(count, "y", true), floor) : floor);
    u.ctx.beginPath();
    u.ctx.moveTo(u.valToPos(x[0], "x", true), floor);
    for (let i = 0; i < y.length; i++) {
      u.ctx.lineTo(u.valToPos(x[i], "x", true), top(y[i]));
      u.ctx.lineTo(u.valToPos(x[i + 1], "x", true), top(y[i]));
    }
    u.ctx.lineTo(u.valToPos(x[y.length], "x", true), floor);
    u.ctx.globalAlpha = 0.12;
    u.ctx.fill();
    u.ctx.globalAlpha = 1;
    u.ctx.stroke();
  }
}
