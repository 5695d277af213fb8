// The numbers of the page: decoding, and what stands behind a point of a reduced signal.

/** Base64 of little-endian numbers as an array of the given kind. */
function decode(text, Kind) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return new Kind(bytes.buffer);
}

/** The first index at which `values`, which ascend, are not below `value`. */
function lowerBound(values, value) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}

/** The first index at which `values`, which ascend, are above `value`. */
function firstAbove(values, value) {
  let index = lowerBound(values, value);
  while (index < values.length && values[index] === value) index++;
  return index;
}

/** The times of a run's samples, maybe reduced: two points, smallest and largest, for each `stride` samples. */
class TimeAxis {
  constructor(spec) {
    this.time = decode(spec.time, Float64Array);
    this.samples = spec.samples;
    this.segments = spec.segments.map(([point, sample, stride]) => ({ point, sample, stride }));
  }

  /** The segment that holds a point. */
  segmentOf(point) {
    let found = this.segments[0];
    for (const segment of this.segments) if (segment.point <= point) found = segment;
    return found;
  }

  /** Where a point lies in the run, counted in samples. */
  sampleAt(point) {
    if (point >= this.time.length) return this.samples;
    const { point: first, sample, stride } = this.segmentOf(point);
    return sample + (point - first) * (stride === 1 ? 1 : stride / 2);
  }

  /** The points from `from` to `to` (s), both of a pair where one is in, at least the nearest to the middle. */
  pointsBetween(from, to) {
    let first = lowerBound(this.time, from), end = lowerBound(this.time, to);
    if (first >= end) {
      const middle = (from + to) / 2, last = this.time.length - 1;
      const after = Math.min(lowerBound(this.time, middle), last), before = Math.max(after - 1, 0);
      first = middle - this.time[before] < this.time[after] - middle ? before : after;
      end = first + 1;
    }
    return [this.wholePairs(first), this.wholePairs(end - 1, 1) + 1];
  }

  /** The point, or the other of its pair, so that `side` (0 first, 1 second) is reached. */
  wholePairs(point, side = 0) {
    const segment = this.segmentOf(point);
    return segment.stride === 1 ? point : segment.point + 2 * ((point - segment.point) >> 1) + side;
  }

  /** Samples between two times, and how many of them share a point pair at most. */
  density(from, to) {
    const first = lowerBound(this.time, from), end = firstAbove(this.time, to);
    let stride = 1;
    for (let s = 0; s < this.segments.length; s++) {
      const next = s + 1 < this.segments.length ? this.segments[s + 1].point : this.time.length;
      if (this.segments[s].point < end && next > first) stride = Math.max(stride, this.segments[s].stride);
    }
    return { samples: this.sampleAt(end) - this.sampleAt(first), stride };
  }
}

/** A signal's values with null for gaps, and the points that stand alone between gaps. */
function signal(spec) {
  const stored = decode(spec.values, Float32Array);
  const gaps = stored.some(Number.isNaN);
  const values = gaps ? new Array(stored.length) : new Float64Array(stored.length);
  for (let i = 0; i < stored.length; i++) values[i] = Number.isNaN(stored[i]) ? null : stored[i] + spec.offset;
  const lone = [];
  if (gaps) {
    for (let i = 0; i < values.length; i++) {
      if (values[i] !== null && (values[i - 1] ?? null) === null && (values[i + 1] ?? null) === null) lone.push(i);
    }
  }
  return { values, lone, empty: extent(values) === null };
}

/** Smallest and largest of values that may hold null or NaN; null where there is none. */
function extent(values, first = 0, end = values.length) {
  let low = Infinity, high = -Infinity;
  for (let i = first; i < end; i++) {
    const value = values[i];
    if (value === null || !Number.isFinite(value)) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : null;
}

/** The range of a linear axis around values: a little room, and a steady signal's noise is not blown up. */
function roomy(low, high) {
  if (low === null || low === undefined || !(low <= high)) return [0, 1];
  const least = 1e-6 * Math.max(Math.abs(low), Math.abs(high));
  const room = high - low > least ? 0.06 * (high - low) : Math.max(0.05 * Math.abs(low), 1e-12) || 1;
  return low === 0 && high === 0 ? [-1, 1] : [low - room, high + room];
}
