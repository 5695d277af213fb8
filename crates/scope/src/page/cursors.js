// Two cursors on the time axis: placed by button and click, by key at the mouse, moved with mouse, touch or arrow keys.

/** How near in pixels a cursor is taken hold of. */
const NEAR = 8;

class Cursors {
  constructor() {
    this.a = null;
    this.b = null;
    this.placing = null;
    this.held = null;
    this.touched = null;
  }

  clear() {
    this.a = this.b = this.placing = this.held = null;
    this.changed();
  }

  place(which, cycle) {
    this[which] = cycle;
    this.placing = null;
    this.touched = which;
    this.changed();
  }

  /** Moves the cursor that was touched last by some cycles; false where there is none. */
  nudge(cycles) {
    if (this.touched === null || this[this.touched] === null) return false;
    this[this.touched] += cycles;
    this.changed();
    return true;
  }

  /** Takes hold of a cursor, or places one: then the mouse does not zoom. */
  grab(u, event) {
    if (event.button !== 0) return false;
    const x = event.clientX - u.over.getBoundingClientRect().left;
    if (this.placing) this.place(this.placing, this.cycleAt(u, x));
    this.held = ["a", "b"].find((which) => this[which] !== null && Math.abs(this.pixel(u, this[which]) - x) <= NEAR) ?? null;
    this.touched = this.held ?? this.touched;
    this.freeze(true);
    return this.held !== null;
  }

  /** Follows pointers over a plot. */
  listen(u) {
    u.over.addEventListener("pointermove", (event) => {
      if (this.held && event.buttons) this.place(this.held, this.cycleAt(u, event.clientX - u.over.getBoundingClientRect().left));
    });
    // Fingers make no mouse events while they move.
    u.over.addEventListener("pointerdown", (event) => { if (event.pointerType !== "mouse") this.grab(u, event); });
    window.addEventListener("pointerup", () => { this.held = null; this.freeze(false); });
  }

  paint(u, view) {
    for (const which of ["a", "b"]) {
      if (this[which] === null) continue;
      paintLine(u, u.valToPos(view.seconds(this[which]), "x", true), themed("--accent"), which.toUpperCase());
    }
  }

  /** What lies between them, in words. */
  told(view) {
    const time = (cycle) => `${reading(view.seconds(cycle), 10 * view.period())} s`;
    const parts = ["a", "b"].filter((which) => this[which] !== null).map((which) => `${which.toUpperCase()} ${time(this[which])}`);
    if (this.a !== null && this.b !== null) {
      const delta = (this.b - this.a) * view.period();
      parts.push(`\u0394t ${reading(1e3 * delta, 10)} ms`);
      if (delta !== 0) parts.push(`1/\u0394t ${reading(1 / Math.abs(delta), Math.abs(1 / delta))} Hz`);
    }
    return parts.join(" \u00b7 ");
  }

  /** For whoever owns the cursors. */
  changed() {}
  freeze() {}
  cycleAt() {}
  pixel() {}
}
