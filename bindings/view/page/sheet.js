// The spreadsheet of the frame: rows are requested as they come into view.
import { element, exact, unit } from "./dom.js";

const most = 300; // rows at a time
const rowHeight = () => 17 * unit(); // as page.css has it

export class Sheet {
  // rows(from, count, sort, descending): requests some; pick(id).
  constructor(root, { rows, pick }) {
    this.ask = rows;
    this.pick = pick;
    this.sort = "id";
    this.descending = false;
    this.head = element("tr");
    this.body = element("tbody");
    this.note = element("div", { class: "quiet" });
    this.root = root;
    root.id = "sheet";
    root.append(this.note, element("table", {}, element("thead", {}, this.head)));
    this.table = root.querySelector("table");
    this.table.append(this.body);
    root.tabIndex = 0;
    root.title = "the points of the frame: click a row, or use the arrow keys";
    root.addEventListener("keydown", (event) => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
      if (!step || !this.rows?.length) return;
      event.preventDefault();
      const at = this.rows.findIndex((row) => row.values.id === this.chosen) + step;
      const { id } = this.rows[Math.min(Math.max(at, 0), this.rows.length - 1)].values;
      this.body.querySelector(`[data-id="${id}"]`).scrollIntoView({ block: "nearest" });
      this.pick(id);
    });
    root.addEventListener("scroll", () => { if (!this.due) this.due = setTimeout(() => { this.due = 0; this.load(); }, 60); });
  }

  // Loads another frame, or nothing to show.
  async refresh() { this.total = undefined; await this.load(); }

  async load() {
    if (this.root.offsetParent === null) return;
    const first = Math.max(0, Math.floor(this.root.scrollTop / rowHeight()) - 50);
    const serial = (this.serial = (this.serial ?? 0) + 1);
    let answer;
    try {
      answer = await this.ask(first, most, this.sort, this.descending);
    } catch (error) {
      this.note.textContent = error.message;
      return;
    }
    if (serial !== this.serial) return;
    this.rows = answer.rows;
    this.note.textContent = answer.total === 0 ? "No points in this frame." : "";
    const names = ["id", ...answer.names.filter((name) => name !== "id")];
    // A vector has a column for each component.
    const parts = (name) => (Array.isArray(answer.rows[0]?.values[name]) ? answer.rows[0].values[name].length : 1);
    const sort = (name) => { this.descending = this.sort === name && !this.descending; this.sort = name; this.root.scrollTop = 0; this.load(); };
    const focused = [...this.head.children].indexOf(document.activeElement);
    this.head.replaceChildren(...names.map((name) => element("th", {
      title: `sort by ${name} (Enter)`, tabindex: 0, colspan: parts(name), onclick: () => sort(name), onkeydown: (event) => { if (event.key === "Enter") sort(name); },
    }, `${name}${this.sort === name ? (this.descending ? " ▾" : " ▴") : ""}`)), element("th", {}, answer.groups.length ? "groups" : ""));
    if (focused >= 0) this.head.children[focused]?.focus();
    const spacer = (rows) => { const row = element("tr"); row.style.height = `${rows * rowHeight()}px`; return row; };
    this.body.replaceChildren(spacer(answer.from), ...answer.rows.map((row) => element("tr", {
      "data-id": row.values.id, class: row.values.id === this.chosen ? "chosen" : "", onclick: () => this.pick(row.values.id),
    }, ...names.flatMap((name) => [row.values[name]].flat().map((value) => element("td", { class: "number" }, exact(value)))), element("td", {}, row.groups.join(", ")))),
    spacer(answer.total - answer.from - answer.rows.length));
  }
}
