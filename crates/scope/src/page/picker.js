// The list of signals, with what is chosen of it.

const FIRST_SHOWN = [
  "reference.angle_rad", "feedback.angle_rad", "control_status.following_error_rad", "control_status.torque_reserve_nm",
  "control_status.state",
];
const MOST_SHOWN = 24;

class Picker {
  constructor(place, search, chosen) {
    this.place = place;
    this.chosen = chosen;
    this.signals = [];
    this.names = recalled("shown", FIRST_SHOWN);
    search.addEventListener("input", () => this.filter(search.value));
  }

  /** The signals that there are. */
  fill(signals) {
    this.signals = signals;
    const known = new Set(signals.map(({ name }) => name));
    this.names = this.names.filter((name) => known.has(name));
    const groups = new Map();
    signals.forEach((signal) => {
      const group = signal.name.slice(0, signal.name.lastIndexOf("."));
      groups.set(group, [...(groups.get(group) ?? []), signal]);
    });
    this.place.replaceChildren(...[...groups].map(([group, members]) => this.group(group, members)));
    this.choose();
  }

  group(name, members) {
    const set = element("fieldset", "");
    set.append(element("legend", "", name.replaceAll("_", " ")));
    members.forEach((signal) => {
      const label = element("label", ""), box = element("input", "");
      box.type = "checkbox";
      box.value = signal.name;
      box.checked = this.names.includes(signal.name);
      box.addEventListener("change", () => this.toggle(signal.name, box));
      const unit = shownUnit(signal.unit).text;
      label.append(box, ` ${shownName(signal.name, signal.unit).slice(signal.name.lastIndexOf(".") + 1)}${unit ? ` (${unit})` : ""}`);
      set.append(label);
    });
    return set;
  }

  toggle(name, box) {
    if (box.checked && this.names.length >= MOST_SHOWN) {
      box.checked = false;
      say(`at most ${MOST_SHOWN} signals at a time`);
      return;
    }
    this.names = box.checked ? [...this.names, name] : this.names.filter((other) => other !== name);
    remember("shown", this.names);
    this.choose();
  }

  choose() {
    this.chosen(this.names.map((name) => this.signals.find((signal) => signal.name === name)));
  }

  filter(text) {
    const words = text.toLowerCase().split(/\s+/);
    for (const set of this.place.querySelectorAll("fieldset")) {
      let some = false;
      for (const label of set.querySelectorAll("label")) {
        const name = label.querySelector("input").value.toLowerCase();
        label.hidden = !words.every((word) => name.includes(word));
        some ||= !label.hidden;
      }
      set.hidden = !some;
    }
  }
}

/** What the page remembers from its last visit; a browser may refuse. */
function recalled(key, otherwise) {
  try {
    return JSON.parse(localStorage.getItem(`scope-${key}`)) ?? otherwise;
  } catch {
    return otherwise;
  }
}

function remember(key, value) {
  try {
    localStorage.setItem(`scope-${key}`, JSON.stringify(value));
  } catch { /* then not */ }
}
