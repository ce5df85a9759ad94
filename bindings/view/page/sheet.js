// The spreadsheet of the frame: rows are asked for as they come into view.
import { element, exact } from "./dom.js";

const rowHeight = 17, most = 300;

export class Sheet {
  // rows(from, count, sort, descending): asks for some; pick(id).
  constructor(root, { rows, pick }) {
    this.ask = rows;
    this.pick = pick;
    this.sort = "id";
    this.descending = false;
    this.head = element("tr");
    this.body = element("tbody");
    this.above = element("div");
    this.below = element("div");
    this.note = element("div", { class: "quiet" });
    this.root = root;
    root.id = "sheet";
    root.append(this.note, element("table", {}, element("thead", {}, this.head)), this.below);
    this.table = root.querySelector("table");
    this.table.append(this.body);
    root.addEventListener("scroll", () => { if (!this.due) this.due = setTimeout(() => { this.due = 0; this.load(); }, 60); });
  }

  // Another frame, or nothing to show.
  async refresh() { this.total = undefined; await this.load(); }

  async load() {
    if (this.root.offsetParent === null) return;
    const first = Math.max(0, Math.floor(this.root.scrollTop / rowHeight) - 50);
    const serial = (this.serial = (this.serial ?? 0) + 1);
    let answer;
    try {
      answer = await this.ask(first, most, this.sort, this.descending);
    } catch (error) {
      this.note.textContent = error.message;
      return;
    }
    if (serial !== this.serial) return;
    this.note.textContent = answer.total === 0 ? "No points in this frame." : "";
    const names = ["id", ...answer.names.filter((name) => name !== "id")];
    this.head.replaceChildren(...names.map((name) => element("th", {
      title: `sort by ${name}`, onclick: () => { this.descending = this.sort === name && !this.descending; this.sort = name; this.root.scrollTop = 0; this.load(); },
    }, `${name}${this.sort === name ? (this.descending ? " ▾" : " ▴") : ""}`)), element("th", {}, answer.groups.length ? "groups" : ""));
    const spacer = (rows) => { const row = element("tr"); row.style.height = `${rows * rowHeight}px`; return row; };
    this.body.replaceChildren(spacer(answer.from), ...answer.rows.map((row) => element("tr", {
      "data-id": row.values.id, class: row.values.id === this.chosen ? "chosen" : "", onclick: () => this.pick(row.values.id),
    }, ...names.map((name) => element("td", { class: "number" }, exact(row.values[name]))), element("td", {}, row.groups.join(", ")))),
    spacer(answer.total - answer.from - answer.rows.length));
  }
}
