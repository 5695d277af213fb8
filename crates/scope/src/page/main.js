// Puts the page together: the connection, the buttons, the keys.

const RECONNECT_MS = 1000;
const SAID_MS = 8000;
const PING_MS = 2000;
/** Latencies that are kept, and how much better a clock's reading must be to be taken, in µs. */
const LATENCIES = 100000;
const HELP = `Drag to zoom, double-click for all. Keys: Space pause, arrows move (with Shift: the cursor touched last, by a cycle),
+ and - zoom, 0 all, A and B put a cursor at the mouse, C clears them, S saves the view, L back to live, T arms, F captures now.`;

const byId = (id) => document.getElementById(id);

/** Tells the user something, for a while. */
function say(text) {
  const place = byId("said");
  place.textContent = text;
  place.hidden = false;
  clearTimeout(say.timer);
  say.timer = setTimeout(() => { place.hidden = true; }, SAID_MS);
}

class Scope {
  constructor() {
    this.view = new View();
    this.cursors = new Cursors();
    this.panels = new Panels(byId("plots"), this.view, this.cursors);
    this.send = (request, capture) => this.ask(request, capture);
    this.picker = new Picker(byId("list"), byId("search"), (signals) => this.choose(signals));
    this.trigger = new Trigger(byId("trigger-form"), byId("trigger-state"), this.send);
    this.captures = new Captures(byId("capture-list"), byId("capture-note"), this.send);
    this.counts = { rows: 0, frames: 0, lost: 0, dropped: 0, drawn: 0 };
    this.clock = null;
    this.latencies = [];
    this.undrawn = null;
    this.alone = false;
    this.wire();
    this.connect();
  }

  connect() {
    const address = new URL("/ws", location.href);
    address.protocol = "ws:";
    address.search = location.search;
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => (typeof data === "string" ? this.told(JSON.parse(data)) : this.came(data));
    this.socket.onopen = () => { this.pings = setInterval(() => this.ping(), PING_MS); this.ping(); };
    this.socket.onclose = () => {
      clearInterval(this.pings);
      this.source("the scope's server has ended", true);
      setTimeout(() => this.connect(), RECONNECT_MS);
    };
  }

  ask(request, capture) {
    if (capture !== undefined) this.wanted = capture ?? "file";
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }

  ping() {
    this.ask({ do: "ping", t: performance.now() });
  }

  told(told) {
    const acts = {
      hello: () => { this.picker.fill(told.signals); this.trigger.fill(told.signals); },
      attached: () => this.attached(told),
      detached: () => this.detached(told),
      gap: () => this.gap(told),
      dropped: () => { this.counts.dropped += told.rows; say(`this page was too slow: ${grouped(told.rows)} rows were not sent to it`); },
      trigger: () => this.trigger.told(told),
      capture: () => this.captured(told),
      samples: () => this.sampled(told),
      captures: () => this.saved(told),
      saved: () => say(`saved: ${told.path}, and the same as .h5`),
      error: () => say(told.text),
      pong: () => this.clocked(told),
    };
    acts[told.is]?.();
  }

  attached(told) {
    this.instance = `${told.instance}: ${told.title}, generation ${told.generation}`;
    this.view.periodS = this.trigger.periodS = told.period_ns / 1e9;
    this.view.live = new Tracks();
    this.source(this.instance, false);
    this.choose(this.shown ?? []);
  }

  /** What is saved; a file that the server was started with is shown at once. */
  saved(told) {
    this.captures.told(told);
    if (told.open && !this.opened) this.ask({ do: "open", file: told.open }, null);
    this.opened = true;
  }

  detached({ why, alone }) {
    this.source(why, !alone);
    this.alone = Boolean(alone);
    for (const live of ["trigger", "pause", "save"]) byId(live).hidden = this.alone;
  }

  source(text, off) {
    byId("source").textContent = text;
    byId("source").classList.toggle("off", off);
  }

  choose(signals) {
    this.shown = signals;
    this.ask({ do: "show", signals: signals.map(({ name }) => name) });
    if (this.view.capture) this.reopen();
    this.panels.choose(signals);
  }

  /** Asks for the capture in view again, with the signals that are chosen now. */
  reopen() {
    const { file, id } = this.view.capture.told;
    if (file) this.ask({ do: "open", file }, null);
    else this.ask({ do: "samples", id }, this.view.capture.told);
  }

  came(buffer) {
    const kept = Math.round(KEPT_S / this.view.periodS);
    for (const frame of frames(buffer)) {
      if (frame.purpose === "capture") {
        this.arriving ??= new Tracks();
        this.arriving.of(frame.topic).replace(frame);
        continue;
      }
      const track = this.view.live.of(frame.topic);
      if (frame.purpose === "past") track.replace(frame);
      else this.appended(track, frame, kept);
    }
    this.soon();
  }

  appended(track, frame, kept) {
    track.append(frame, kept);
    this.counts.frames += 1;
    this.counts.rows += frame.cycles.length;
    track.received += frame.cycles.length;
    track.begun ??= frame.cycles[0];
    this.undrawn = Math.max(this.undrawn ?? 0, frame.number);
  }

  gap({ topic, before_cycle: before, lost }) {
    this.counts.lost += lost;
    this.view.live.of(topic).gaps.push({ before, lost });
    say(`${lost} messages never came (before cycle ${before}); marked in the plots`);
  }

  captured(told) {
    this.captures.came(told);
    this.announced = new Map([...(this.announced ?? []), [told.id, told]].slice(-20));
    const ended = told.word === "ended";
    if (ended) say(`${told.text} is kept as a capture: #${told.id}`);
    // A stretch that somebody looks at is not taken away; a file was asked for.
    this.taken = told.file || !(this.view.paused || ended) ? told.id : this.taken;
  }

  /** All samples of a capture are there. */
  sampled({ id }) {
    const told = this.announced?.get(id) ?? (this.wanted?.id === id ? this.wanted : null);
    const asked = this.wanted === "file" ? told?.file : this.wanted?.id === id;
    const tracks = this.arriving ?? new Tracks();
    this.arriving = null;
    if (!told || !(asked || this.taken === id)) return;
    const same = this.view.capture && this.view.capture.told.id === id;
    if (asked) this.wanted = null;
    for (const { topic, before_cycle: before, lost } of told.gaps) tracks.of(topic).gaps.push({ before, lost });
    this.view.capture = { told, tracks, window: told.window, periodS: told.period_ns / 1e9 };
    if (!same) this.view.range = [told.window.from, told.window.to];
    // What was asked for stays until it is left.
    if (asked) this.view.paused = true;
    this.captures.shown = told.file ?? id;
    this.captures.write();
    this.changed();
  }

  backToLive() {
    this.view.capture = null;
    this.view.paused = false;
    this.taken = this.wanted = null;
    this.captures.shown = null;
    this.captures.write();
    this.changed();
  }

  pause() {
    this.view.bounds();
    this.view.paused = !this.view.paused;
    this.changed();
  }

  save() {
    const { capture } = this.view;
    if (capture?.told.file) { say("this capture is saved already"); return; }
    if (capture) { this.ask({ do: "save-capture", id: capture.told.id }); return; }
    const [from, to] = this.view.bounds();
    this.ask({ do: "save", from: Math.max(0, from), to, zero: Math.max(0, from) });
  }

  /** Draws with the browser's next frame. */
  soon() {
    if (this.asked || !(this.view.rolls() || this.dirty)) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.dirty = false; this.draw(); });
  }

  changed() {
    this.dirty = true;
    this.soon();
    this.tell();
  }

  draw() {
    this.panels.draw();
    this.counts.drawn += 1;
    // uPlot paints in a microtask of its own: behind it the samples are on the canvas.
    const newest = this.undrawn;
    this.undrawn = null;
    queueMicrotask(() => queueMicrotask(() => this.painted(newest)));
  }

  painted(newestUs) {
    if (newestUs && this.clock && this.view.rolls()) {
      if (this.latencies.length >= LATENCIES) this.latencies.splice(0, LATENCIES / 2);
      this.latencies.push(performance.now() - (newestUs / 1e3 + this.clock.offset));
    }
    this.tell();
  }

  /** From the loop's clock to the page's, by the quickest answer so far. */
  clocked({ t, us }) {
    const now = performance.now(), trip = now - t;
    if (!this.clock || trip < this.clock.trip) this.clock = { trip, offset: (t + now) / 2 - us / 1e3 };
    // Clocks drift: an old reading grows worse.
    else this.clock.trip += 0.02;
  }

  /** Counts from now on. */
  measure() {
    this.before = { ...this.counts };
    for (const track of this.view.live.byTopic.values()) { track.received = 0; track.begun = null; }
  }

  /** What was counted since, for a bench: latencies in ms, rows, and cycles of which nothing is known. */
  measured() {
    const sorted = [...this.latencies].sort((a, b) => a - b), at = (share) => sorted[Math.floor(share * (sorted.length - 1))];
    const since = Object.fromEntries(Object.keys(this.counts).map((key) => [key, this.counts[key] - this.before[key]]));
    const tracks = [...this.view.live.byTopic.values()].filter((track) => track.received);
    const cycles = tracks.reduce((sum, track) => sum + track.newest() - track.begun + 1, 0);
    return { ...since, median_ms: at(0.5), p99_ms: at(0.99), unaccounted: cycles - since.rows - since.lost - since.dropped };
  }

  tell() {
    const { view } = this, rolling = view.rolls();
    byId("pause").textContent = view.paused ? "Run" : "Pause";
    byId("pause").setAttribute("aria-pressed", String(view.paused));
    byId("live").hidden = rolling || this.alone;
    for (const which of ["a", "b"]) byId(`cursor-${which}`).setAttribute("aria-pressed", String(this.cursors.placing === which));
    const parts = [this.cursors.told(view)];
    if (view.capture) parts.push(`${view.capture.told.text}; time zero at ${view.capture.told.word === "ended" ? "its end" : "the trigger"}`);
    const { lost, dropped } = this.counts;
    parts.push(lost || dropped ? `${grouped(lost)} messages lost, ${grouped(dropped)} rows not sent here` : "no gaps");
    byId("seen").textContent = parts.filter(Boolean).join(" \u00b7 ");
  }

  wire() {
    const { view, cursors, panels } = this;
    panels.changed = cursors.changed = () => this.changed();
    cursors.freeze = (on) => { view.bounds(); view.frozen = on; };
    cursors.cycleAt = (u, x) => view.cycle(u.posToVal(x, "x"));
    cursors.pixel = (u, cycle) => u.valToPos(view.seconds(cycle), "x");
    const act = (change) => () => { change(); this.changed(); };
    const place = (which) => () => { cursors.placing = cursors.placing === which ? null : which; this.changed(); };
    const acts = {
      pause: () => this.pause(), live: () => this.backToLive(), save: () => this.save(),
      back: act(() => view.move(-0.25)), on: act(() => view.move(0.25)), closer: act(() => view.zoom(0.5)),
      wider: act(() => view.zoom(2)), whole: act(() => view.show(...view.whole())), clear: () => cursors.clear(),
      "cursor-a": place("a"), "cursor-b": place("b"),
      arm: () => this.ask({ do: "arm" }), force: () => this.ask({ do: "force" }),
    };
    for (const [id, does] of Object.entries(acts)) byId(id).addEventListener("click", does);
    this.keys = {
      " ": acts.pause, l: acts.live, s: acts.save, ArrowLeft: acts.back, ArrowRight: acts.on, "+": acts.closer, "-": acts.wider,
      0: acts.whole, c: acts.clear, t: acts.arm, f: acts.force, a: () => this.placeAtMouse("a"), b: () => this.placeAtMouse("b"),
    };
    document.addEventListener("keydown", (event) => this.key(event));
    byId("help").title = HELP;
    const span = byId("span");
    span.append(...SPANS_S.map((seconds) => new Option(seconds < 1 ? `${1e3 * seconds} ms` : `${seconds} s`, seconds)));
    span.value = String(view.spanS);
    span.addEventListener("change", () => { view.spanS = Number(span.value); this.resized(); });
  }

  /** Another length of window: of what rolls by, or about the middle of what is in view. */
  resized() {
    const { view } = this;
    if (!view.rolls()) {
      const [from, to] = view.range, half = view.spanS / view.period() / 2, middle = (from + to) / 2;
      view.show(middle - half, middle + half);
    }
    this.changed();
  }

  placeAtMouse(which) {
    const [from, to] = this.view.bounds();
    this.cursors.place(which, this.panels.hovered() ?? Math.round((from + to) / 2));
  }

  key(event) {
    const typing = event.target.matches?.("input:not([type=checkbox]), select, textarea");
    const pressing = event.key === " " && event.target.matches?.("button, input, summary");
    if (typing || pressing || event.ctrlKey || event.metaKey || event.altKey) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.shiftKey && step && this.cursors.nudge(step)) { event.preventDefault(); return; }
    const act = this.keys[event.key] ?? this.keys[event.key.toLowerCase()];
    if (!act) return;
    event.preventDefault();
    act();
  }
}

/** For whoever looks at the page from outside. */
window.scope = new Scope();
