// The chosen point and its life; the chosen node; the chosen region.
import { element, exact, brief, bytes, seconds, prepare, colour } from "./dom.js";

export class Inspector {
  // actions: go(frame); trace(id), which requests a life; close(what).
  constructor(root, actions) {
    this.root = root;
    this.actions = actions;
    this.parts = Object.fromEntries(["node", "point", "region", "frame-figures", "messages"].map((name) => {
      const part = element("section", { id: name, hidden: true });
      root.append(part);
      return [name, part];
    }));
    this.hint = element("section", { id: "hint", class: "quiet" }, "Click a point to see its values and its life, or a node to see the points after it. Drag with Shift to see the ranges in a region. ? lists all keys.");
    root.append(this.hint);
  }

  put(name, title, ...children) {
    const part = this.parts[name];
    part.hidden = false;
    this.hinted();
    part.replaceChildren(element("h2", {}, title, element("span", { class: "gap" }),
      ["messages", "frame-figures"].includes(name) ? null : element("button", { title: "close (Esc)", onclick: () => this.actions.close(name) }, "×")), ...children.filter(Boolean));
  }

  hide(name) {
    this.parts[name].hidden = true;
    this.parts[name].replaceChildren();
    this.hinted();
  }

  // Shows the hint only if nothing is chosen.
  hinted() { this.hint.hidden = ["node", "point", "region"].some((name) => !this.parts[name].hidden); }

  // path: [frame, x, y, z, speed, error, substeps] for each frame that has the point.
  point(id, row, life, path = [], frame = NaN) {
    if (!row) return this.hide("point");
    const rows = Object.entries(row.values).map(([name, value]) =>
      element("tr", { "data-attribute": name }, element("th", {}, name), element("td", { class: "number" }, exact(value))));
    if (row.groups.length) rows.push(element("tr", {}, element("th", {}, "groups"), element("td", { class: "number" }, row.groups.join(", "))));
    const table = element("table", { id: "attributes" }, ...rows);
    const curves = [[4, "speed", "m/s"], [5, "estimated error", "m"], [6, "substeps", ""]]
      .map(([k, name, of]) => this.curve(name, of, path.filter((place) => typeof place[k] === "number").map((place) => [place[0], place[k]]), frame));
    if (life === "") this.put("point", `Point ${id}`, table, ...curves.map((curve) => curve?.box)); // files: no life
    else this.put("point", `Point ${id}`, table, ...curves.map((curve) => curve?.box),
      element("h2", { class: "life-head" }, "Life", element("span", { class: "gap" }),
        life ? null : element("button", { id: "trace", title: "computes the life of the point: births, edits, forces, contacts (B)", onclick: () => this.actions.trace(id) }, "show life")),
      life ? this.life(life) : element("div", { class: "quiet" }, "Its birth, edits by nodes, contacts and death are computed on request."));
    for (const curve of curves) curve?.draw();
  }

  // Returns a curve of the point's values over its frames, or null if they are all 0.
  curve(name, of, values, frame) {
    if (values.length < 2 || values.every(([, v]) => v === 0)) return null;
    const most = Math.max(...values.map(([, v]) => v)), first = values[0][0], last = values[values.length - 1][0];
    const here = values.find(([f]) => f === frame);
    const canvas = element("canvas", { title: `${name} of the point over its frames: click to go to a frame`, onclick: (event) => {
      const box = canvas.getBoundingClientRect();
      this.actions.go(Math.round(first + ((event.clientX - box.left) / box.width) * (last - first)));
    } });
    const box = element("figure", { class: "curve", "data-curve": name }, element("figcaption", {}, name, element("span", { class: "number" }, `${here ? brief(here[1]) : "–"} of ${brief(most)} ${of}`)), canvas);
    return { box, draw() {
      const { context, width, height } = prepare(canvas);
      const x = (f) => ((f - first) / (last - first)) * width, y = (v) => height - 1 - (v / (most || 1)) * (height - 3);
      context.fillStyle = colour("line");
      if (here) context.fillRect(x(frame) - 0.5, 0, 1, height);
      context.strokeStyle = colour("accent");
      context.lineWidth = 1.2;
      context.beginPath();
      for (const [f, v] of values) context.lineTo(x(f), y(v));
      context.stroke();
    } };
  }

  // life: as in rapid trace --json, or a message.
  life(life) {
    if (typeof life === "string") return element("div", { class: "quiet" }, life);
    const list = element("ul", { class: "life", id: "life" });
    const add = (frame, text, kind = "") => list.append(element("li", { class: kind },
      element("button", { class: "small", title: "go to this frame", onclick: () => this.actions.go(frame) }, frame), element("span", {}, text)));
    if (life.birth) add(life.birth.frame, `${life.birth.why}, ${brief(life.birth.time)} s`, "birth");
    let asleep = false, edits = "", forces = "";
    for (const step of life.steps) {
      const changed = step.edits.map((edit) => `${edit.node}: ${edit.removed ? "not in the output" : Object.keys(edit.changes).join(", ")}`).join("; ");
      if (changed !== edits && changed) add(step.frame, changed);
      edits = changed;
      const pushed = step.forces.map((force) => `${force.node} ${brief(Math.hypot(...force.acceleration))} m/s²`).join(", ");
      if (pushed !== forces && pushed && forces === "") add(step.frame, pushed, "quiet");
      forces = pushed;
      if (step.asleep !== asleep) add(step.frame, step.asleep ? "sleeps" : "is awake again");
      asleep = step.asleep;
      for (const contact of step.contacts) add(step.frame, `meets ${contact.node} at ${brief(contact.speed)} m/s, ${brief(contact.time)} s`, "contact");
    }
    if (life.death) add(life.death.frame, `${life.death.why}, ${brief(life.death.time)} s`, "death");
    return list;
  }

  node(node, given) {
    if (!node) return this.hide("node");
    const rows = Object.entries(given ?? node.arguments).map(([name, value]) =>
      element("tr", {}, element("th", {}, name), element("td", { class: "number" }, value)));
    for (const what of ["makes", "reads", "writes"])
      if (node[what].length) rows.push(element("tr", {}, element("th", {}, what), element("td", {}, node[what].join(", "))));
    this.put("node", `After ${node.name}`, element("div", { class: "quiet" }, `${node.type}, line ${node.line}: the picture shows the points as this node leaves them. Evaluated ${node.evaluated}${node.changes ? `: ${node.changes}` : ""}.`),
      element("table", {}, ...rows));
  }

  region(found) {
    if (!found) return this.hide("region");
    const rows = Object.entries(found.ranges).map(([name, [low, mean, high]]) =>
      element("tr", {}, element("th", {}, name), element("td", { class: "number" }, brief(low)), element("td", { class: "number" }, brief(mean)), element("td", { class: "number" }, brief(high))));
    this.put("region", `Region: ${brief(found.count)} points`, element("table", {},
      element("tr", {}, element("th", {}), ...["smallest", "mean", "largest"].map((t) => element("td", { class: "number quiet" }, t))), ...rows),
      ...Object.entries(found.groups).map(([name, count]) => element("div", {}, `${brief(count)} in ${name}`)));
  }

  frame(number, figure, status, charts) {
    const rows = [];
    const add = (name, text, title) => rows.push(element("tr", title ? { title } : {}, element("th", {}, name), element("td", { class: "number" }, text)));
    if (figure?.seconds) {
      add("points", `${brief(figure.points)}  (+${brief(figure.born)} −${brief(figure.died)})`, "born, died in this frame");
      for (const stage of ["solve", "script", "graph"]) if (figure.seconds[stage] > 0) add(stage, seconds(figure.seconds[stage]));
      for (const { name, unitName, lines } of charts) {
        const value = lines[0][2](figure);
        if (name && name !== "points" && unitName !== "s" && value) add(name, `${brief(value)} ${unitName}`);
      }
    } else if (figure) {
      add("points", brief(figure.points));
    }
    add("in memory", `${bytes(status.bytes)} of ${bytes(status.most_bytes)}`);
    const kept = Object.entries(status.names).filter(([, size]) => size >= 0);
    add("attributes", kept.map(([name]) => name).filter((name) => name !== "dt").join(", "), `at most ${kept.reduce((sum, [, size]) => sum + size, 0)} bytes a point`);
    this.put("frame-figures", `Frame ${number}`, element("table", {}, ...rows));
  }

  messages(status) {
    if (!status.warnings.length) return this.hide("messages");
    // Warnings that differ only in numbers are shown as the first one and a count of the rest.
    const kinds = new Map();
    for (const warning of status.warnings) {
      const kind = warning.text.replace(/\d[\d.e+-]*/g, "#"), known = kinds.get(kind);
      if (known) { ++known.more; known.last = warning.frame; } else kinds.set(kind, { ...warning, more: 0 });
    }
    const rows = [...kinds.values()].map(({ frame, text, more, last }) => element("li", {},
      frame > 0 ? element("button", { class: "small", title: "go to this frame", onclick: () => this.actions.go(frame) }, frame) : null, ` ${text}`,
      more > 0 ? element("span", { class: "quiet" }, ` (${more} more like it, the last in frame ${last})`) : null));
    if (status.more_warnings) rows.push(element("li", { class: "quiet" }, `and ${status.more_warnings} more`));
    this.put("messages", "Warnings", element("ul", { class: "list" }, ...rows));
  }
}
