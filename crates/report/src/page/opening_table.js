// A table whose rows open and close by a click; rows of what is selected elsewhere light up.

/** Tells all tables which rows are meant, by name; `null` for none. */
function lightUp(names) {
  document.dispatchEvent(new CustomEvent("report-selected", { detail: names }));
}

class OpeningTable {
  constructor(table) {
    this.rows = [...table.querySelectorAll("tr.opens")];
    for (const row of this.rows) row.addEventListener("click", () => this.toggle(row));
    document.addEventListener("report-selected", (event) => this.light(event.detail));
  }

  toggle(row) {
    const opened = row.nextElementSibling;
    opened.hidden = !opened.hidden;
    row.querySelector("button").setAttribute("aria-expanded", String(!opened.hidden));
  }

  light(names) {
    for (const row of this.rows) row.classList.toggle("lit", names !== null && names.has(row.dataset.name));
  }
}
