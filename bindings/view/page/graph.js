// The graph: nodes as Graphviz has laid them out, with points and time in this frame; a click shows the points after a
// node.
import { svg, element, brief, seconds, unit } from "./dom.js";

export class Graph {
  constructor(root, { choose }) {
    this.root = root;
    this.choose = choose;
    this.chosen = "";
    this.picture = null;
    this.scale = 1;
    root.append(element("div", { class: "quiet" }, ""));
    root.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.zoom(Math.exp(-Math.sign(event.deltaY) * 0.15));
    }, { passive: false });
  }

  zoom(by) {
    this.scale = Math.min(Math.max(this.scale * by, 0.2), 3);
    this.size();
  }

  size() {
    const drawing = this.root.querySelector("svg");
    if (!drawing || !this.picture?.size) return;
    const [width, height] = this.picture.size;
    // As large as the dock is high, but legible.
    const fits = unit() * Math.min(1.2, Math.max(0.72,
      Math.min((this.root.clientHeight - 12) / (height + 16), (this.root.clientWidth - 4) / (width + 16)) / unit()));
    drawing.setAttribute("width", (width + 16) * fits * this.scale);
    drawing.setAttribute("height", (height + 16) * fits * this.scale);
  }

  show(picture, why) {
    if (!picture) {
      this.root.replaceChildren(element("p", { class: "quiet" }, why || "The graph is drawn after the first frame."));
      return;
    }
    this.picture = picture;
    if (!picture.size) return this.showList(why);
    const [width, height] = picture.size;
    const drawing = svg("svg", { id: "graph", viewBox: `-8 -8 ${width + 16} ${height + 16}` });
    for (const edge of picture.edges) {
      if (!edge.path) continue;
      const [first, ...rest] = edge.path, head = rest[rest.length - 1], before = rest[rest.length - 2];
      drawing.append(svg("path", { class: edge.kind, d: `M${first} C${rest.slice(0, -1).join(" ")} L${head}` }));
      const angle = Math.atan2(head[1] - before[1], head[0] - before[0]);
      const corner = (turn, far) => [head[0] - far * Math.cos(angle + turn), head[1] - far * Math.sin(angle + turn)];
      drawing.append(svg("path", { class: "tip", d: `M${head} L${corner(0.4, 7)} L${corner(-0.4, 7)} Z` }));
    }
    this.facts = new Map();
    for (const node of picture.nodes) {
      if (node.x === undefined) continue;
      const fact = svg("text", { x: node.x, y: node.y + 11, class: "fact" }, node.type);
      const group = svg("g", {
        class: `node ${node.kind}${node.kept ? "" : " left-out"}`, tabindex: node.kept ? 0 : -1, role: "button",
        "data-node": node.name, "aria-label": node.name,
        onclick: () => node.kept && this.toggle(node.name),
        onkeydown: (event) => { if (event.key === "Enter" && node.kept) this.toggle(node.name); },
      }, svg("title", {}, tip(node)),
        svg("rect", { x: node.x - node.width / 2, y: node.y - node.height / 2, width: node.width, height: node.height, rx: 5 }),
        svg("text", { x: node.x, y: node.y - 2 }, node.name), fact);
      this.facts.set(node.name, { fact, group, node });
      drawing.append(group);
    }
    this.root.replaceChildren(drawing);
    this.size();
    this.mark();
  }

  // Without Graphviz: the nodes in their order.
  showList(why) {
    this.facts = new Map();
    const rows = this.picture.nodes.map((node) => {
      const fact = element("td", { class: "quiet" }, node.type);
      const row = element("tr", { title: tip(node), "data-node": node.name, onclick: () => node.kept && this.toggle(node.name) },
        element("td", {}, node.name), fact);
      this.facts.set(node.name, { fact, group: row, node });
      return row;
    });
    this.root.replaceChildren(element("p", { class: "quiet" }, why), element("table", {}, ...rows));
    this.mark();
  }

  toggle(name) {
    this.chosen = this.chosen === name ? "" : name;
    this.mark();
    this.choose(this.chosen);
  }

  mark() {
    for (const [name, { group }] of this.facts ?? []) group.classList.toggle("chosen", name === this.chosen);
  }

  // Points and seconds of each node in a frame.
  figures(statistics) {
    if (!this.facts || !statistics?.nodes) return;
    for (const { fact, node } of this.facts.values()) fact.textContent = node.type;
    for (const work of statistics.nodes)
      work.nodes.forEach((name, k) => {
        const known = this.facts.get(name);
        if (known) known.fact.textContent = k === 0 ? `${brief(work.points)} · ${seconds(work.seconds)}` : `${brief(work.points)} · fused`;
      });
  }

  node(name) { return this.picture?.nodes.find((node) => node.name === name); }
}

function tip(node) {
  const lines = [`${node.name}: ${node.type}, ${node.file}:${node.line}`];
  for (const [name, value] of Object.entries(node.arguments)) lines.push(`  ${name} = ${value}`);
  for (const what of ["makes", "reads", "writes"]) if (node[what].length) lines.push(`${what} ${node[what].join(", ")}`);
  lines.push(node.kept ? `evaluated ${node.evaluated}${node.changes ? `; ${node.changes}` : ""}` : `left out: ${node.why}`);
  return lines.join("\n");
}
