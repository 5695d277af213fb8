// The plots: one for each unit, one above the other, their signals' names and values beside them.

const PANEL_HEIGHT = 168;
const Y_AXIS_WIDTH = 70;
/** Points a pixel column from which smallest and largest stand for all. */
const POINTS_PER_COLUMN = 2;
const CURSORS_KEY = "scope";

class Panels {
  constructor(place, view, cursors) {
    this.place = place;
    this.view = view;
    this.cursors = cursors;
    this.panels = [];
    this.mouse = null;
    onTheme(() => this.panels.forEach((panel) => panel.plot?.redraw()));
    onWidth(place, () => this.resize());
  }

  /** Shows these signals. */
  choose(signals) {
    this.panels.forEach((panel) => panel.plot?.destroy());
    this.place.replaceChildren();
    const groups = new Map();
    signals.forEach((signal) => {
      // States are not drawn over counts, nor errors over what they are errors of: one of the two would be a flat line.
      const key = signal.codes.length ? signal.name : `${signal.unit} ${signal.name.includes("error")}`;
      groups.set(key, [...(groups.get(key) ?? []), signal]);
    });
    this.panels = [...groups.values()].map((group) => this.panel(group));
    if (signals.length) this.place.append(this.axisNote = element("p", "note axis-note"));
    if (!signals.length) this.place.append(element("p", "note", "No signal is chosen."));
    this.draw();
  }

  panel(signals) {
    const box = element("div", "scope-panel"), plotPlace = element("div", "plot-place"), names = element("div", "names");
    box.append(plotPlace, names);
    this.place.append(box);
    const panel = { signals, plotPlace, names: new Names(names, signals), ...shownUnit(signals[0].unit) };
    panel.plot = this.plot(panel);
    return panel;
  }

  plot(panel) {
    const [first] = panel.signals, states = first.codes.length > 0 && !first.flags;
    const name = first.codes.length ? first.name.split(".").pop() : panel.text;
    const range = states ? (u, low, high) => [Math.min(low ?? 0, 0) - 0.5, Math.max(high ?? 1, 1) + 0.5] : (u, low, high) => roomy(low, high);
    const values = (u, splits, axis, space, step) => splits.map((value) => (states ? stateName(first, value) : tick(value, step)));
    const made = new uPlot({
      width: Math.max(200, panel.plotPlace.clientWidth), height: PANEL_HEIGHT, padding: [8, 18, 0, 0],
      cursor: {
        y: false, drag: { x: true, y: false, dist: 5, setScale: false },
        sync: { key: CURSORS_KEY, scales: ["x", null], setSeries: false },
        bind: {
          dblclick: () => () => { this.view.show(...this.view.whole()); this.changed(); return null; },
          mousedown: (u, target, handle) => (event) => (this.cursors.grab(u, event) ? null : handle(event)),
        },
      },
      legend: { show: false },
      scales: { x: { time: false, range: (u, low, high) => [low, high] }, y: { range } },
      axes: [
        styledAxis({ size: 24, space: 80, values: (u, splits, axis, space, step) => splits.map((value) => tick(value, step)) }),
        styledAxis({
          size: Y_AXIS_WIDTH - 18, label: name, labelSize: 18, labelGap: 0, space: states ? 16 : 28, values,
          ...(states ? { incrs: [1, 2, 5, 10, 20] } : {}),
        }),
      ],
      series: [{}, ...panel.signals.map((signal, index) => ({
        label: signal.name, stroke: () => seriesColour(index), width: 1.5, points: { show: false },
      }))],
      hooks: {
        setSelect: [(u) => this.selected(u)],
        setCursor: [(u) => this.moved(u)],
        draw: [(u) => { this.paintGaps(u, panel); this.paintZero(u); this.cursors.paint(u, this.view); }],
      },
    }, [[0, 1], ...panel.signals.map(() => [null, null])], panel.plotPlace);
    this.cursors.listen(made);
    return made;
  }

  resize() {
    this.panels.forEach(({ plot, plotPlace }) => plot.setSize({ width: Math.max(200, plotPlace.clientWidth), height: PANEL_HEIGHT }));
    this.draw();
  }

  selected(u) {
    const { left, width } = u.select;
    if (width < 2) return;
    const at = (pixel) => this.view.cycle(u.posToVal(pixel, "x"));
    this.view.show(at(left), at(left + width));
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.changed();
  }

  moved(u) {
    this.mouse = u.cursor.left >= 0 ? u.cursor.left : null;
    this.tellValues();
  }

  /** The cycle under the mouse, which changes under a still mouse while the view rolls; null where there is none. */
  hovered() {
    const plot = this.panels[0]?.plot;
    return this.mouse === null || !plot ? null : this.view.cycle(plot.posToVal(this.mouse, "x"));
  }

  /** Draws what is in view. */
  draw() {
    if (this.axisNote) this.axisNote.textContent = this.view.capture ? "time from the trigger (s)" : "time since the loop's start (s)";
    const [from, to] = this.view.bounds(), tracks = this.view.tracks();
    const width = this.panels[0]?.plot.over.clientWidth || 800;
    const stride = Math.max(1, Math.floor((to - from + 1) / (POINTS_PER_COLUMN * width)));
    const times = this.times(from, to, stride);
    for (const { plot, signals, factor } of this.panels) {
      const values = signals.map(({ topic, field }) => (stride === 1
        ? tracks.of(topic).each(field, from, to, factor) : tracks.of(topic).thinned(field, from, to, stride, factor)));
      plot.setData([times, ...values], false);
      plot.setScale("x", { min: this.view.seconds(from), max: this.view.seconds(to) });
    }
    this.tellValues();
  }

  times(from, to, stride) {
    if (stride === 1) return Array.from({ length: to - from + 1 }, (_, index) => this.view.seconds(from + index));
    const buckets = Math.ceil((to - from + 1) / stride);
    return Array.from({ length: 2 * buckets }, (_, index) => this.view.seconds(from + (index / 2) * stride));
  }

  /** Where messages were lost the plot says so, whatever is beside. */
  paintGaps(u, { signals }) {
    const topics = new Set(signals.map(({ topic }) => topic));
    u.ctx.save();
    u.ctx.fillStyle = themed("--fault-fill");
    for (const topic of topics) {
      for (const { before, lost } of this.view.tracks().of(topic).gaps) {
        const [left, right] = [before - lost, before].map((cycle) => u.valToPos(this.view.seconds(cycle), "x", true));
        if (right < u.bbox.left || left > u.bbox.left + u.bbox.width) continue;
        u.ctx.globalCompositeOperation = "destination-over";
        u.ctx.fillRect(left, u.bbox.top, Math.max(2, right - left), u.bbox.height);
      }
    }
    u.ctx.restore();
  }

  paintZero(u) {
    if (!this.view.capture) return;
    paintLine(u, u.valToPos(0, "x", true), themed("--attention"), "T");
  }

  tellValues() {
    const tracks = this.view.tracks(), { a, b } = this.cursors;
    this.panels.forEach((panel) => panel.names.tell(tracks, this.hovered(), a, b, panel.factor));
  }

  /** For whoever owns the panels. */
  changed() {}
}

/** A line through a plot, with a letter at its top. */
function paintLine(u, x, colour, letter) {
  const { ctx, bbox } = u;
  if (x < bbox.left - 1 || x > bbox.left + bbox.width + 1) return;
  ctx.save();
  ctx.strokeStyle = ctx.fillStyle = colour;
  ctx.lineWidth = 1.5 * uPlot.pxRatio;
  ctx.beginPath();
  ctx.moveTo(x, bbox.top);
  ctx.lineTo(x, bbox.top + bbox.height);
  ctx.stroke();
  ctx.font = FONT.replace("12px", `${12 * uPlot.pxRatio}px`);
  ctx.textBaseline = "top";
  ctx.fillText(letter, x + 3 * uPlot.pxRatio, bbox.top);
  ctx.restore();
}

/** A state's name on an axis, as far as there is room for it. */
function stateName({ codes }, value) {
  const name = codes.find(([code]) => code === value)?.[1] ?? "";
  return name.length > 9 ? `${name.slice(0, 8)}\u2026` : name;
}

/** Names and values beside a plot. */
class Names {
  constructor(place, signals) {
    this.table = element("table", "");
    this.head = this.table.createTHead().insertRow();
    this.head.append(...["now", "a", "b", "d"].map(() => element("th", "")));
    const body = this.table.createTBody();
    this.rows = signals.map((signal, index) => {
      const name = body.insertRow().appendChild(element("th", "")), mark = element("span", "mark");
      const unit = shownUnit(signal.unit).text;
      name.colSpan = 4;
      mark.style.background = `var(--series-${index % SERIES_COLOURS})`;
      // Long names may break where their words end.
      name.append(mark, ...shownName(signal.name, signal.unit).split(/(?<=[._])/).flatMap((word) => [word, element("wbr", "")]), unit ? ` (${unit})` : "");
      const row = body.insertRow();
      return { signal, cells: ["now", "a", "b", "d"].map(() => row.appendChild(element("td", ""))) };
    });
    place.append(this.table);
  }

  /** Values at the mouse, or the newest; at both cursors, and between them. */
  tell(tracks, hovered, a, b, factor) {
    const both = a !== null && b !== null;
    [hovered === null ? "newest" : "mouse", a === null ? "" : "A", b === null ? "" : "B", both ? "\u0394" : ""].forEach((text, index) => {
      if (this.head.cells[index].textContent !== text) this.head.cells[index].textContent = text;
    });
    for (const { signal, cells } of this.rows) {
      const track = tracks.of(signal.topic);
      const read = (cycle) => (cycle === null ? null : track.at(signal.field, cycle));
      const values = [read(hovered ?? track.newest()), read(a), read(b)];
      const delta = both && values[1] !== null && values[2] !== null ? values[2] - values[1] : null;
      const wanted = [true, a !== null, b !== null, both];
      [...values, delta].forEach((value, index) => {
        const text = !wanted[index] ? "" : value === null ? "\u2013" : named(signal, value, index === 3, factor);
        if (cells[index].textContent !== text) cells[index].textContent = text;
      });
    }
  }
}

/** A value as people read it: a state by its name, flags by theirs. */
function named(signal, value, isDelta, factor) {
  if (signal.codes.length && !isDelta) {
    if (!signal.flags) return signal.codes.find(([code]) => code === value)?.[1] ?? String(value);
    const set = signal.codes.filter(([bit]) => Math.floor(value / bit) % 2 === 1).map(([, name]) => name);
    return set.length > 2 ? `${set.length} set` : set.join(", ") || "none";
  }
  const shown = value * factor;
  // Five digits: an angle at rest differs from its reference in the fifth.
  return Number.isInteger(value) && factor === 1 ? String(value).replace("-", MINUS) : reading(shown, Math.abs(shown) / 10);
}
