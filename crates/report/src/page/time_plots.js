// Signals over time: panels one above the other, with one zoom and one cursor.

const PANEL_HEIGHT = 168;
const X_AXIS_HEIGHT = 24;
const X_LABEL_HEIGHT = 18;
const Y_AXIS_WIDTH = 78;
const MARGIN = 16;
/** Legends stand beside their plots from this width on, and take so much of it; the style sheet has the same number. */
const LEGEND_WIDTH = 330;
const WIDE = 1000;
const MISSING = "\u2013";
/** Samples per pixel column from which a moving signal is a band rather than a line. */
const DENSE = 100;
const LINES = { normal: { width: 1.5 }, underlay: { width: 5, alpha: 0.35 }, dashed: { width: 1.5, dash: [6, 4] } };
const HELP = "Drag to zoom, double-click for the whole run. Ctrl + wheel zooms, Shift + wheel moves. Click a name to hide it.";
const DECADES = Array.from({ length: 16 }, (_, k) => k - 12).flatMap((power) => [1, 2, 5].map((step) => step * 10 ** power));
const CLOCK_STEPS = [...DECADES.filter((step) => step < 10),
  10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 21600, 43200, 86400, 172800, 432000, 864000];

class TimePlots {
  constructor(figure, spec) {
    this.key = `time-${TimePlots.count = (TimePlots.count ?? 0) + 1}`;
    this.axes = spec.axes.map((axis) => new TimeAxis(axis));
    this.strips = new Strips(spec.strips, spec.markers);
    this.panels = spec.panels.map((panel) => this.loaded(panel));
    this.rightAxis = this.panels.some((panel) => panel.units.length > 1);
    this.full = this.wholeRun();
    this.view = this.full;
    this.clock = this.full[1] - this.full[0] > 3600;
    this.bar = this.toolbar();
    this.place = element("div", "stack");
    figure.prepend(this.bar, this.place);
    onTheme(() => this.plots?.forEach((plot) => plot.redraw()));
    onWidth(this.place, (width) => this.resize(width));
  }

  loaded(panel) {
    const series = panel.series.map((one) => ({ name: one.name, scale: one.scale, line: one.line, ...signal(one) }));
    return { title: panel.title, axis: this.axes[panel.axis], units: panel.units, series };
  }

  wholeRun() {
    const ends = this.axes.filter((axis) => axis.time.length).flatMap(({ time }) => [time[0], time[time.length - 1]]);
    const [from, to] = extent([...ends, ...(this.strips.span() ?? [])]) ?? [0, 1];
    return to > from ? [from, to] : [from - 0.5, to + 0.5];
  }

  toolbar() {
    const bar = element("div", "toolbar");
    this.at = element("span", "at");
    this.seen = element("span", "seen");
    this.whole = element("button", "", "Whole run");
    this.whole.type = "button";
    this.whole.addEventListener("click", () => this.show(this.full));
    const csv = element("button", "", "CSV");
    csv.type = "button";
    csv.title = "Saves the samples in view as text: a column a signal, of the first time axis";
    csv.addEventListener("click", () => this.save());
    const help = element("span", "help", "?");
    help.title = HELP;
    bar.append(this.at, this.seen, this.whole, csv, help);
    return bar;
  }

  /** The samples in view as text with commas, SI or as the panels show them: the units stand in the first line. */
  csv() {
    const [axis] = this.axes, [from, to] = this.view;
    const first = lowerBound(axis.time, from), end = firstAbove(axis.time, to);
    const columns = this.panels.filter((panel) => panel.axis === axis).flatMap((panel) => panel.series
      .map((series) => ({ name: `${panel.title}: ${series.name} (${panel.units[series.scale]})`, values: series.values })));
    const quoted = (text) => `"${text.replaceAll("\"", "\"\"")}"`;
    const lines = [["time (s)", ...columns.map(({ name }) => name)].map(quoted).join(",")];
    for (let i = first; i < end; i++) {
      lines.push([axis.time[i], ...columns.map(({ values }) => (values[i] === null || Number.isNaN(values[i]) ? "" : values[i]))].join(","));
    }
    return `${lines.join("\n")}\n`;
  }

  save() {
    const link = element("a", "");
    link.href = URL.createObjectURL(new Blob([this.csv()], { type: "text/csv" }));
    link.download = `${document.title.replaceAll(/[^\w-]+/g, "-")}.csv`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  resize(whole) {
    const wide = whole >= WIDE, width = wide ? whole - LEGEND_WIDTH : whole;
    this.place.classList.toggle("wide", wide);
    if (this.plots) this.plots.forEach((plot) => plot.setSize({ width, height: plot.height }));
    else this.plots = this.draw(width);
    // uPlot lays itself out in a microtask of its own.
    requestAnimationFrame(() => this.changed());
  }

  draw(width) {
    const plots = [];
    if (this.strips.names.length) plots.push(this.stripPlot(width, this.row(this.strips.head)));
    this.panels.forEach((panel, index) => {
      const head = element("div", "plot-head");
      head.append(element("span", "plot-title", panel.title));
      plots.push(this.panelPlot(width, panel, head, index === this.panels.length - 1));
    });
    plots.forEach((plot) => plot.over.addEventListener("wheel", (event) => this.wheel(plot, event), { passive: false }));
    return plots;
  }

  /** A plot's place, with its head: above it, or beside it where the window is wide. */
  row(head) {
    const row = element("div", "plot-row");
    row.append(head);
    this.place.append(row);
    return row;
  }

  /** What all plots of the stack have in common. */
  shared(width, height) {
    return {
      width, height,
      cursor: {
        y: false,
        sync: { key: this.key, scales: ["x", null], setSeries: false },
        drag: { x: true, y: false, dist: 5 },
        bind: { dblclick: () => () => { this.show(this.full); return null; } },
      },
      legend: { show: false },
    };
  }

  xScale() {
    return { time: false, min: this.view[0], max: this.view[1], range: (u, low, high) => [low, high] };
  }

  xAxis(last) {
    const decimals = (step) => Math.min(9, decimalsOf(step));
    return styledAxis({
      size: X_AXIS_HEIGHT, space: 80, incrs: this.clock ? CLOCK_STEPS : DECADES,
      values: (u, splits, axis, space, step) =>
        splits.map((time) => (this.clock ? clock(time, decimals(step)) : tick(time, step))),
      ...(last ? { label: this.clock ? "time (h:mm:ss)" : "time (s)", labelSize: X_LABEL_HEIGHT, labelGap: 0 } : {}),
    });
  }

  hooks(draw, before = () => {}) {
    return {
      setScale: [(u, key) => { if (key === "x") this.show([u.scales.x.min, u.scales.x.max]); }],
      setCursor: [(u) => this.moved(u)],
      drawClear: [before],
      draw: [draw],
    };
  }

  stripPlot(width, place) {
    return new uPlot({
      ...this.shared(width, this.strips.height),
      padding: [0, this.rightAxis ? Y_AXIS_WIDTH : MARGIN, 0, 0],
      scales: { x: this.xScale(), rows: { auto: false, range: [0, this.strips.names.length] } },
      axes: [this.xAxis(this.panels.length === 0), this.strips.axis()],
      series: [{}, { scale: "rows" }],
      hooks: this.hooks((u) => this.strips.paint(u)),
    }, [this.full, [null, null]], place);
  }

  panelPlot(width, panel, head, last) {
    const scales = { x: this.xScale() };
    const axes = [this.xAxis(last)];
    panel.units.forEach((unit, index) => {
      scales[`y${index}`] = { range: (u, low, high) => roomy(low, high) };
      axes.push(this.yAxis(unit, index));
    });
    return new uPlot({
      ...this.shared(width, PANEL_HEIGHT + (last ? X_LABEL_HEIGHT : 0)),
      padding: [8, panel.units.length > 1 ? 0 : this.rightAxis ? Y_AXIS_WIDTH : MARGIN, 0, 0],
      legend: { markers: LEGEND_MARKS, mount: (u, legend) => head.append(legend) },
      scales, axes,
      series: [{}, ...panel.series.map((series, index) => this.drawn(panel, series, index))],
      hooks: this.hooks((u) => {
        this.strips.paintLines(u);
        if (panel.series.every((series) => series.empty)) paintNote(u, "no values");
      }, (u) => this.adapt(u, panel)),
    }, [panel.axis.time, ...panel.series.map((series) => series.values)], this.row(head));
  }

  yAxis(unit, index) {
    return styledAxis({
      scale: `y${index}`, side: index === 0 ? 3 : 1, size: Y_AXIS_WIDTH - X_LABEL_HEIGHT,
      label: unit, labelSize: X_LABEL_HEIGHT, labelGap: 0, space: 28,
      values: (u, splits, axis, space, step) => splits.map((value) => tick(value, step)),
      ...(index === 0 ? {} : { grid: { show: false } }),
    });
  }

  drawn(panel, series, index) {
    const unit = panel.units[series.scale];
    return {
      label: series.name, scale: `y${series.scale}`, stroke: () => seriesColour(index), ...LINES[series.line],
      gaps: (u, seriesIndex, first, last, gaps) => {
        const [begin, end] = [first, last].map((point) => u.valToPos(panel.axis.time[point], "x", true));
        return withinColumns(gaps, begin, end);
      },
      points: {
        size: 5, width: 1, fill: () => seriesColour(index),
        filter: (u, seriesIndex, show) => (show ? null : lonePoints(series.lone, u.scales.x, panel.axis.time)),
      },
      value: (u, value, seriesIndex, point) => {
        const text = point === null || point === undefined ? "" : this.read(u, panel, series);
        return text === "" || text === MISSING ? text : `${text} ${unit}`;
      },
    };
  }

  /** Where signals become solid bands, lets them shine through each other, and draws no dashes. */
  adapt(u, panel) {
    const { samples } = panel.axis.density(u.scales.x.min, u.scales.x.max);
    const bands = samples > DENSE * u.over.clientWidth;
    panel.series.forEach((series, index) => {
      const style = LINES[series.line], drawn = u.series[index + 1];
      drawn.alpha = bands && panel.series.length > 1 ? 0.6 : style.alpha ?? 1;
      drawn.dash = bands ? undefined : style.dash;
      drawn.width = bands ? 1 : style.width;
    });
  }

  /**
   * What the cursor's pixel column holds of a signal: its value, or its smallest and largest. Where a column stands
   * for many samples its neighbours count too, so that a peak as thin as a hair is easily met.
   */
  read(u, panel, series) {
    const { min, max } = u.scales.x, column = (max - min) / u.over.clientWidth;
    const time = u.posToVal(u.cursor.left, "x");
    const reach = panel.axis.density(time - column / 2, time + column / 2).samples > 2 ? 1.5 * column : column / 2;
    const [first, end] = panel.axis.pointsBetween(time - reach, time + reach);
    const found = extent(series.values, first, end);
    if (!found) return MISSING;
    const scale = u.scales[`y${series.scale}`], span = scale.max - scale.min;
    const [low, high] = found.map((value) => reading(value, span));
    return low === high ? low : `${low}\u2009\u2026\u2009${high}`;
  }

  /** Shows a stretch of time in all plots. */
  show([from, to]) {
    const [low, high] = this.view, least = 1e-9 * Math.max(Math.abs(from), Math.abs(to), 1e-3);
    const same = Math.abs(from - low) < least && Math.abs(to - high) < least;
    if (same || !(to - from > least) || !this.plots) return;
    this.view = [from, to];
    this.plots.forEach((plot) => plot.setScale("x", { min: from, max: to }));
    this.changed();
  }

  /** Tells in the toolbar what is in view and how far it is reduced. */
  changed() {
    const [from, to] = this.view, span = to - from;
    const columns = this.plots[0]?.over.clientWidth || 1;
    this.whole.disabled = from === this.full[0] && to === this.full[1];
    const parts = [`${this.timeText(from, span)}\u2009\u2026\u2009${this.timeText(to, span)}`];
    if (this.axes.length) {
      const { samples, stride } = this.axes[0].density(from, to);
      const each = samples / columns;
      parts.push(samples === 1 ? "1 sample" : `${grouped(samples)} samples`);
      if (stride > 1 && each < stride) parts.push(`smallest and largest of every ${grouped(stride)} (the page holds no more)`);
      else if (each >= 2) parts.push(`each pixel column shows the smallest and largest of ${grouped(each)}`);
    }
    this.seen.textContent = parts.join(" \u00b7 ");
  }

  timeText(time, span) {
    const decimals = Math.min(9, Math.max(0, Math.ceil(3 - Math.log10(span))));
    return this.clock ? clock(time, decimals) : `${fixed(time, decimals)} s`;
  }

  moved(u) {
    const inside = u.cursor.left >= 0;
    const time = inside ? u.posToVal(u.cursor.left, "x") : null;
    const span = this.view[1] - this.view[0];
    this.at.textContent = inside ? this.timeText(time, span) : "";
    this.strips.tell(time, (6 * span) / u.over.clientWidth);
  }

  wheel(u, event) {
    if (!event.ctrlKey && !event.metaKey && !event.shiftKey) return;
    event.preventDefault();
    const [from, to] = this.view, turn = event.deltaY || event.deltaX;
    if (event.shiftKey) {
      const step = 0.15 * (to - from) * Math.sign(turn);
      const by = Math.min(Math.max(step, this.full[0] - from), this.full[1] - to);
      this.show([from + by, to + by]);
    } else {
      const factor = turn > 0 ? 1.4 : 1 / 1.4;
      const about = u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x");
      const at = (end) => about + (end - about) * factor;
      this.show([Math.max(this.full[0], at(from)), Math.min(this.full[1], at(to))]);
    }
  }
}

/** A few words in the middle of a plot. */
function paintNote({ ctx, bbox }, text) {
  ctx.save();
  ctx.font = FONT.replace("12px", `${12 * uPlot.pxRatio}px`);
  ctx.fillStyle = themed("--muted");
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillText(text, bbox.left + bbox.width / 2, bbox.top + bbox.height / 2);
  ctx.restore();
}

/** Points without a neighbour, which no line shows; null where none is in view. */
function lonePoints(lone, { min, max }, time) {
  const seen = lone.filter((point) => time[point] >= min && time[point] <= max);
  return seen.length ? seen : null;
}

/**
 * Gaps in pixels, as they are cut out of a signal that is seen from `begin` to `end`. What lies between two of them within one column
 * would be cut away whole: there a gap ends within the columns of its neighbours. Elsewhere it takes all of the line that leads across,
 * which uPlot begins up to a column before the last point.
 */
function withinColumns(gaps, begin, end) {
  return gaps.map(([from, to], index) => [
    from - (gaps[index - 1]?.[1] ?? begin) < 2 ? from + 0.5 : from - 1,
    (gaps[index + 1]?.[0] ?? end) - to < 2 ? to - 0.5 : to,
  ]);
}
