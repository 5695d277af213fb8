// States and events above the signals: a row for each, coloured by how much it matters.

const ROW_HEIGHT = 24;

class Strips {
  constructor(strips, markers) {
    this.rows = strips.map(({ name, intervals }) => ({
      name,
      intervals: intervals.map(([from, to, label, level]) => ({ from, to, label, level: LEVELS[level] })),
    }));
    this.markers = markers.map(([time, label, level]) => ({ time, label, level: LEVELS[level] }));
    this.markers.sort((a, b) => a.time - b.time);
    this.names = [...(markers.length ? ["events"] : []), ...this.rows.map((row) => row.name)];
    this.head = element("div", "plot-head");
    this.head.append(element("span", "plot-title", "States and events"));
    this.now = element("span", "now");
    this.head.append(this.now);
  }

  get height() {
    return this.names.length * ROW_HEIGHT + X_AXIS_HEIGHT;
  }

  /** First and last moment of note. */
  span() {
    const times = this.markers.map((marker) => marker.time);
    for (const row of this.rows) for (const interval of row.intervals) times.push(interval.from, interval.to);
    return extent(times);
  }

  /** The rows as an axis of a plot that has 0 at the bottom. */
  axis() {
    const count = this.names.length;
    return styledAxis({
      scale: "rows", size: Y_AXIS_WIDTH, gap: 8, grid: { show: false }, ticks: { show: false },
      splits: () => this.names.map((_, row) => count - row - 0.5),
      values: () => this.names,
      filter: (u, splits) => splits,
    });
  }

  paint(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.font = FONT.replace("12px", `${12 * uPlot.pxRatio}px`);
    ctx.textBaseline = "middle";
    ctx.textAlign = "left";
    const row = bbox.height / this.names.length;
    const first = this.markers.length ? 1 : 0;
    if (first) this.paintEvents(u, bbox.top + row / 2);
    this.rows.forEach(({ intervals }, index) => this.paintRow(u, intervals, bbox.top + (first + index) * row, row));
    ctx.restore();
  }

  paintRow(u, intervals, top, height) {
    const { ctx, bbox } = u, px = uPlot.pxRatio, right = bbox.left + bbox.width;
    for (const { from, to, label, level } of intervals) {
      const start = u.valToPos(from, "x", true), end = u.valToPos(to, "x", true);
      if (end < bbox.left || start > right) continue;
      const left = Math.max(start, bbox.left), width = Math.max(Math.min(end, right) - left, px);
      ctx.fillStyle = themed(`--${level}-fill`);
      ctx.fillRect(left, top + 3 * px, width, height - 6 * px);
      ctx.fillStyle = themed(`--${level}`);
      if (left === start) ctx.fillRect(left, top + 3 * px, Math.min(2 * px, width), height - 6 * px);
      if (width > 16 * px && ctx.measureText(label).width < width - 12 * px) {
        ctx.fillStyle = themed("--text");
        ctx.fillText(label, left + 7 * px, top + height / 2 + px / 2);
      }
    }
  }

  /** A triangle for each event, its text where there is room: after it, before it, or shortened. */
  paintEvents(u, middle) {
    const { ctx, bbox } = u, px = uPlot.pxRatio, right = bbox.left + bbox.width;
    let written = bbox.left;
    this.markers.forEach(({ time, label, level }, index) => {
      const x = u.valToPos(time, "x", true);
      if (x < bbox.left - 1 || x > right + 1) return;
      const next = index + 1 < this.markers.length ? u.valToPos(this.markers[index + 1].time, "x", true) : right;
      ctx.fillStyle = themed(`--${level}`);
      ctx.beginPath();
      ctx.moveTo(x - 4 * px, middle - 5 * px);
      ctx.lineTo(x + 4 * px, middle - 5 * px);
      ctx.lineTo(x, middle + 5 * px);
      ctx.fill();
      const width = ctx.measureText(label).width, after = Math.min(next, right) - x - 16 * px;
      const before = width > after && x - 8 * px - width > written;
      const text = before ? label : shortened(ctx, label, after);
      ctx.fillStyle = themed("--text");
      ctx.fillText(text, before ? x - 8 * px - width : x + 8 * px, middle + px / 2);
      written = before ? x + 4 * px : x + 16 * px + ctx.measureText(text).width;
    });
  }

  /** A line through a plot at each event. */
  paintLines(u) {
    const { ctx, bbox } = u, px = uPlot.pxRatio;
    ctx.save();
    ctx.lineWidth = px;
    ctx.setLineDash([3 * px, 3 * px]);
    for (const { time, level } of this.markers) {
      const x = Math.round(u.valToPos(time, "x", true)) + 0.5;
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.strokeStyle = themed(`--${level}`);
      ctx.globalAlpha = level === "fault" ? 0.9 : 0.45;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  /** What was the case at a time, and the event no further than `reach` (s) from it. */
  tell(time, reach) {
    if (time === null) { this.now.textContent = ""; return; }
    const told = this.rows.map(({ name, intervals }) => {
      const found = intervals.find(({ from, to }) => from <= time && time < to);
      return found ? `${name}: ${found.label}` : "";
    });
    const near = this.markers.filter((marker) => Math.abs(marker.time - time) <= reach);
    near.sort((a, b) => Math.abs(a.time - time) - Math.abs(b.time - time));
    if (near.length) told.unshift(`\u25bc ${near[0].label}`);
    this.now.textContent = told.filter(Boolean).join("  \u00b7  ");
  }
}

/** As much of a text as fits into so many pixels. */
function shortened(ctx, text, width) {
  if (ctx.measureText(text).width <= width) return text;
  for (let length = text.length - 1; length > 3; length--) {
    const short = text.slice(0, length).trimEnd() + "\u2026";
    if (ctx.measureText(short).width <= width) return short;
  }
  return "";
}
