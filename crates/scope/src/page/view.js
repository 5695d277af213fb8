// Which cycles are in view: the newest, a stretch that was paused at, or a capture.

const SPANS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60];
const LEAST_CYCLES = 4;

class View {
  constructor() {
    this.live = new Tracks();
    this.capture = null;
    this.paused = false;
    // While the mouse is down on a plot, so that what is dragged over stands still.
    this.frozen = false;
    this.periodS = 1e-3;
    this.spanS = 5;
    this.range = [0, 5000];
  }

  tracks() {
    return this.capture ? this.capture.tracks : this.live;
  }

  /** The cycle that time counts from: the trigger, or the generation's first. */
  zero() {
    return this.capture ? this.capture.window.zero : 0;
  }

  period() {
    return this.capture ? this.capture.periodS : this.periodS;
  }

  rolls() {
    return !this.paused && !this.frozen && !this.capture;
  }

  /** The first and last cycle in view. */
  bounds() {
    if (this.rolls()) {
      const extent = this.live.extent(), cycles = Math.round(this.spanS / this.periodS);
      const last = extent ? extent[1] : cycles;
      this.range = [last - cycles, last];
    }
    return this.range;
  }

  /** All that there is. */
  whole() {
    if (this.capture) return [this.capture.window.from, this.capture.window.to];
    return this.live.extent() ?? this.range;
  }

  /** Shows a stretch, and stays there whatever comes. */
  show(from, to) {
    const [first, last] = this.whole();
    const length = Math.max(LEAST_CYCLES, Math.min(Math.round(to - from), Math.max(last - first, LEAST_CYCLES)));
    const start = Math.max(first, Math.min(Math.round(from), last - length));
    this.range = [start, start + length];
    this.paused = true;
  }

  zoom(factor, about) {
    const [from, to] = this.bounds(), middle = about ?? (from + to) / 2;
    this.show(middle - (middle - from) * factor, middle + (to - middle) * factor);
  }

  move(share) {
    const [from, to] = this.bounds(), by = share * (to - from);
    this.show(from + by, to + by);
  }

  seconds(cycle) {
    return (cycle - this.zero()) * this.period();
  }

  cycle(seconds) {
    return Math.round(seconds / this.period()) + this.zero();
  }
}
