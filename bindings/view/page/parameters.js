// The parameters of the scene: a slider, number, vector, checkbox or text each.
import { element, exact } from "./dom.js";

// Returns the range of a number's slider: from zero to twice its default, or on both sides of zero if that is zero. A
// number beyond it can be typed.
function limits(fallback) {
  if (fallback === 0) return [-1, 1];
  return fallback > 0 ? [0, 2 * fallback] : [2 * fallback, 0];
}

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

export class Parameters {
  // change(values): runs the scene with these; copy(text, advice): copies text to the
  // clipboard, and shows the advice.
  constructor(root, { change, copy }) {
    this.root = root;
    this.change = change;
    this.list = element("div");
    this.reset = element("button", { title: "resets all parameters to the scene's values", onclick: () => this.send({}) }, "reset");
    root.append(
      element("h2", {}, "Parameters", element("span", { class: "gap" }), this.reset,
        element("button", { title: "copies the changed values as options for rapid run", id: "copy-set", onclick: () => copy(this.options(),
          "paste it after rapid run SCENE in a terminal, or write the values into the scene as the defaults of rapid.param") }, "copy --set")),
      this.list);
    this.values = {};
    this.fields = new Map();
  }

  options() {
    return Object.entries(this.values).map(([name, value]) => `--set '${`${name}=${Array.isArray(value) ? value.join(",") : value}`.replaceAll("'", "'\\''")}'`).join(" ");
  }

  send(values) {
    this.values = values;
    this.reset.disabled = Object.keys(values).length === 0;
    this.change(values);
  }

  give(name, value) {
    const parameter = this.known.find((p) => p.name === name);
    const values = { ...this.values };
    if (same(parameter.default, value)) delete values[name];
    else values[name] = value;
    this.send(values);
  }

  show(status) {
    const shape = status.parameters.map((p) => [p.name, p.doc, p.default]);
    const held = this.root.contains(document.activeElement);
    if (!held) this.values = Object.fromEntries(status.parameters.filter((p) => p.set).map((p) => [p.name, p.value]));
    this.known = status.parameters;
    this.reset.disabled = Object.keys(status.values).length === 0;
    if (!same(shape, this.shape)) {
      this.shape = shape;
      this.fields.clear();
      this.list.replaceChildren(...(this.known.length ? this.known.map((p) => this.row(p))
        : [element("div", { class: "quiet" }, "This scene has none. Add one with rapid.param(name, default, doc).")]));
    }
    for (const parameter of this.known) {
      const field = this.fields.get(parameter.name);
      field.row.classList.toggle("set", !same(parameter.value, parameter.default));
      if (!held) field.put(parameter.value);
    }
  }

  row(parameter) {
    const { name, doc, default: fallback } = parameter;
    const title = `${name}, by default ${exact(fallback)}`, give = (value) => this.give(name, value);
    const row = element("div", { class: "parameter", "data-name": name });
    const head = element("span", { class: "name", title }, name);
    const tail = doc ? element("span", { class: "doc" }, doc) : null;
    let put;
    if (typeof fallback === "number") {
      const [min, max] = limits(fallback);
      const slider = element("input", { type: "range", min, max, step: Number.isInteger(fallback) && Math.abs(fallback) >= 10 ? 1 : "any", title, "aria-label": name });
      const number = element("input", { type: "number", step: "any", title, "aria-label": name });
      // At most one run per picture while it is dragged.
      slider.addEventListener("input", () => {
        number.value = Number(Number(slider.value).toPrecision(4));
        if (!this.due) this.due = requestAnimationFrame(() => { this.due = 0; give(Number(number.value)); });
      });
      number.addEventListener("change", () => { slider.value = number.value; give(Number(number.value)); });
      put = (value) => {
        slider.min = Math.min(min, value);
        slider.max = Math.max(max, value);
        slider.value = value;
        number.value = value;
      };
      row.append(head, number, slider);
    } else if (typeof fallback === "boolean") {
      const tick = element("input", { type: "checkbox", title, "aria-label": name, onchange: () => give(tick.checked) });
      put = (value) => { tick.checked = value; };
      row.append(head, tick);
    } else if (Array.isArray(fallback)) {
      const parts = fallback.map((_, k) => element("input", { type: "number", step: "any", title, "aria-label": `${name} ${"xyz"[k]}`,
        onchange: () => give(parts.map((part) => Number(part.value))) }));
      put = (value) => parts.forEach((part, k) => { part.value = value[k]; });
      row.append(head, element("span"), element("span", { class: "vector" }, ...parts));
    } else {
      const text = element("input", { type: "text", title, "aria-label": name, onchange: () => give(text.value) });
      put = (value) => { text.value = value; };
      row.append(head, element("span"), text);
    }
    if (tail) row.append(tail);
    this.fields.set(name, { row, put });
    return row;
  }
}
