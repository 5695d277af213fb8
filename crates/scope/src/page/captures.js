// The captures: those that came and are held by the server, and those that were saved.

const MOST_LISTED = 8;

class Captures {
  constructor(list, note, send) {
    this.list = list;
    this.note = note;
    this.send = send;
    this.held = [];
    this.saved = [];
    this.shown = null;
  }

  /** A capture came. */
  came(capture) {
    if (capture.file) return;
    this.held = [capture, ...this.held].slice(0, MOST_LISTED);
    this.write();
  }

  /** What is saved. */
  told({ folder, list }) {
    this.saved = list;
    this.note.textContent = list.length ? `saved in ${folder}` : `captures are saved in ${folder}`;
    this.write();
  }

  write() {
    const heading = (text) => element("p", "note", text);
    const parts = [];
    if (this.held.length) parts.push(heading("captured, not saved by themselves unless told to"));
    for (const capture of this.held) {
      parts.push(this.button(`#${capture.id} ${capture.text}`, this.shown === capture.id, () => this.send({ do: "samples", id: capture.id }, capture)));
    }
    if (this.saved.length) parts.push(heading("saved"));
    for (const { name, hdf5 } of [...this.saved].reverse().slice(0, 50)) {
      parts.push(this.button(`${name}${hdf5 ? ", .h5" : ""}`, this.shown === name, () => this.send({ do: "open", file: name }, null)));
    }
    this.list.replaceChildren(...parts);
  }

  button(text, pressed, act) {
    const button = element("button", "", text);
    button.type = "button";
    button.setAttribute("aria-pressed", String(pressed));
    button.addEventListener("click", act);
    return button;
  }
}
