// The trigger's form. The state machine itself is the server's (trigger.rs): it sees every sample, shown or not.

const FAULT = "control_status.fault";
const STATES = {
  off: "off", filling: "waits for enough past", armed: "armed", capturing: "triggered", "hold-off": "hold-off",
  stopped: "stopped: arm it again",
};

class Trigger {
  constructor(form, state, send) {
    this.form = form;
    this.state = state;
    this.send = send;
    this.signals = [];
    this.periodS = 1e-3;
    form.addEventListener("submit", (event) => { event.preventDefault(); this.set(); });
    form.kind.addEventListener("change", () => this.arrange());
    form.signal.addEventListener("change", () => this.arrange());
    form.autosave.addEventListener("change", () => send({ do: "auto-save", on: form.autosave.checked }));
    this.arrange();
  }

  fill(signals) {
    const before = this.form.signal.value || "control_status.following_error_rad";
    this.signals = signals;
    this.form.signal.replaceChildren(...signals.map(({ name, unit }) => new Option(shownName(name, unit), name)));
    this.form.signal.value = before;
    this.arrange();
  }

  /** Shows what the kind of trigger needs, in the signal's unit. */
  arrange() {
    const kind = this.form.kind.value;
    for (const label of this.form.querySelectorAll("[data-for]")) label.hidden = !label.dataset.for.split(" ").includes(kind);
    const { text } = this.unit();
    this.form.querySelectorAll(".unit").forEach((place) => { place.textContent = text; });
  }

  unit() {
    const signal = this.signals.find(({ name }) => name === this.form.signal.value);
    return shownUnit(signal?.unit ?? "1");
  }

  set() {
    this.send({ do: "trigger", settings: this.form.mode.value === "off" ? null : this.settings() });
  }

  settings() {
    const { form } = this, kind = form.kind.value;
    const cycles = (field) => Math.round(Number(field.value) / (1e3 * this.periodS));
    return {
      signal: kind === "fault" ? FAULT : form.signal.value,
      condition: this.condition(kind),
      mode: form.mode.value,
      pre_cycles: cycles(form.pre), post_cycles: cycles(form.post), delay_cycles: cycles(form.delay),
      hold_off_cycles: cycles(form.holdoff),
    };
  }

  condition(kind) {
    const { form } = this, { factor } = this.unit();
    const value = (field) => Number(field.value) / factor;
    switch (kind) {
      case "edge": return { kind, level: value(form.level), slope: form.slope.value, hysteresis: value(form.hysteresis) };
      case "level": return { kind, level: value(form.level), above: form.above.value === "above" };
      case "window": return { kind, low: value(form.low), high: value(form.high), inside: form.inside.value === "enters" };
      case "fault": return { kind: "raised" };
      default: return { kind };
    }
  }

  /** What the server says of it. */
  told({ settings, at, auto_save: autoSave }) {
    this.state.textContent = STATES[at.state] ?? at.state;
    this.form.autosave.checked = autoSave;
    // Another page may have set it.
    if (!settings && document.activeElement !== this.form.mode && this.wasSet) this.form.mode.value = "off";
    this.wasSet = settings !== null;
  }
}
