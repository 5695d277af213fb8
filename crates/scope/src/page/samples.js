// The samples that the server sends: decoded, kept by message, and thinned to what a screen shows.

/** Cycles that are kept of what rolls by, in seconds; the server holds its own past beside it. */
const KEPT_S = 120;
const PURPOSES = ["live", "past", "capture"];

/** What each unit is shown as, and by what its numbers are multiplied. */
const UNITS = {
  rad: ["\u00b0", 180 / Math.PI], "rad/s": ["\u00b0/s", 180 / Math.PI], "rad/s^2": ["\u00b0/s\u00b2", 180 / Math.PI],
  "rad/s^3": ["\u00b0/s\u00b3", 180 / Math.PI], ns: ["\u00b5s", 1e-3], Pa: ["MPa", 1e-6], Hz: ["kHz", 1e-3],
  degC: ["\u00b0C", 1], "N*m": ["N\u00b7m", 1], 1: ["", 1],
};

/** How a unit is shown: its text and factor. */
function shownUnit(unit) {
  const [text, factor] = UNITS[unit] ?? [unit, 1];
  return { text, factor };
}

/** A signal's name without the unit at its end, where another one is shown beside it. */
function shownName(name, unit) {
  return shownUnit(unit).text === unit ? name : name.replace(/_(rad(_per_s\d?)?|ns|pa|hz|c|nm)$/, "");
}

/** The frames of a binary message; see frame.rs. */
function frames(buffer) {
  const found = [];
  let at = 0;
  while (at < buffer.byteLength) {
    const [purpose, topic, rows, count] = new Uint32Array(buffer, at, 4);
    const [number] = new Float64Array(buffer, at + 16, 1);
    const fields = [...new Uint32Array(buffer, at + 24, count)];
    at += 24 + 8 * Math.ceil(count / 2);
    const take = () => { const column = new Float64Array(buffer, at, rows); at += 8 * rows; return column; };
    const cycles = take();
    const columns = fields.map(take);
    found.push({ purpose: PURPOSES[purpose], topic, number, fields, cycles, columns });
  }
  return found;
}

/** The samples of one kind of message, the oldest first. */
class Track {
  constructor() {
    this.length = 0;
    this.cycles = new Float64Array(0);
    this.columns = new Map();
    this.gaps = [];
    // What came live since counting began.
    this.received = 0;
    this.begun = null;
  }

  /** Puts these in place of all that were there. */
  replace({ fields, cycles, columns }) {
    this.length = cycles.length;
    this.cycles = cycles.slice();
    this.columns = new Map(fields.map((field, index) => [field, columns[index].slice()]));
    this.gaps = [];
  }

  /** Adds what came; keeps `kept` cycles. */
  append({ fields, cycles, columns }, kept) {
    const needed = this.length + cycles.length;
    if (needed > this.cycles.length) this.makeRoom(needed, kept);
    this.cycles.set(cycles, this.length);
    for (const [field, column] of this.columns) {
      const index = fields.indexOf(field);
      if (index >= 0) column.set(columns[index], this.length);
      else column.fill(NaN, this.length, this.length + cycles.length);
    }
    this.length += cycles.length;
  }

  /** Forgets what is older than `kept` cycles, and grows where that is not enough: so a copy is made now and then only. */
  makeRoom(needed, kept) {
    const newest = this.length ? this.cycles[this.length - 1] : 0;
    const first = this.first(newest - kept), left = this.length - first;
    const size = Math.max(1024, 2 * (left + needed - this.length));
    const move = (old) => { const next = new Float64Array(size); next.set(old.subarray(first, this.length)); return next; };
    this.cycles = move(this.cycles);
    for (const [field, column] of this.columns) this.columns.set(field, move(column));
    this.length = left;
    this.gaps = this.gaps.filter((gap) => gap.before >= newest - kept);
  }

  /** The index of the first sample that is not before a cycle. */
  first(cycle) {
    return lowerBound(this.cycles.subarray(0, this.length), cycle);
  }

  newest() {
    return this.length ? this.cycles[this.length - 1] : null;
  }

  /** The value at a cycle; null where there is none. */
  at(field, cycle) {
    const index = this.first(cycle);
    if (index >= this.length || this.cycles[index] !== cycle) return null;
    const value = this.columns.get(field)?.[index];
    return value === undefined || Number.isNaN(value) ? null : value;
  }

  /** One value for each cycle from `from` to `to`; null where a sample is missing. */
  each(field, from, to, factor) {
    const out = new Array(to - from + 1).fill(null), column = this.columns.get(field);
    if (!column) return out;
    for (let i = this.first(from); i < this.length && this.cycles[i] <= to; i++) {
      const value = column[i];
      if (!Number.isNaN(value)) out[this.cycles[i] - from] = value * factor;
    }
    return out;
  }

  /** Smallest and largest of every `stride` cycles, in the order in which they came: no peak is lost. */
  thinned(field, from, to, stride, factor) {
    const buckets = Math.ceil((to - from + 1) / stride);
    const out = new Array(2 * buckets).fill(null), column = this.columns.get(field);
    if (!column) return out;
    let i = this.first(from);
    for (let bucket = 0; bucket < buckets; bucket++) {
      const end = Math.min(to + 1, from + (bucket + 1) * stride);
      let low = Infinity, high = -Infinity, lowFirst = true;
      for (; i < this.length && this.cycles[i] < end; i++) {
        const value = column[i];
        if (value < low) { low = value; lowFirst = false; }
        if (value > high) { high = value; lowFirst = true; }
      }
      if (low > high) continue;
      // What came last of the two stands second.
      out[2 * bucket] = (lowFirst ? low : high) * factor;
      out[2 * bucket + 1] = (lowFirst ? high : low) * factor;
    }
    return out;
  }
}

/** Tracks by topic: what rolls by, or a capture. */
class Tracks {
  constructor() {
    this.byTopic = new Map();
  }

  of(topic) {
    let track = this.byTopic.get(topic);
    if (!track) this.byTopic.set(topic, track = new Track());
    return track;
  }

  /** The first and last cycle of all; null where there is none. */
  extent() {
    const full = [...this.byTopic.values()].filter((track) => track.length);
    if (!full.length) return null;
    return [Math.min(...full.map((track) => track.cycles[0])), Math.max(...full.map((track) => track.newest()))];
  }
}
