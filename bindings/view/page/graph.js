// The graph: nodes as laid out by Graphviz or layout.js, with points and time in this frame. A click shows the points
// after a node; a search finds nodes by name or type.
import { svg, element, count, seconds, unit } from "./dom.js";
import { layOut } from "./layout.js";

const legible = 0.85; // fraction of the size of other text

export class Graph {
  // choose(name): selects the points after a node, or "" for the output; tools: the place for the search.
  constructor(root, tools, { choose }) {
    this.root = root;
    this.choose = choose;
    this.chosen = "";
    this.picture = null;
    this.scale = 1;
    this.found = element("span", { class: "quiet number" });
    this.search = element("input", { type: "search", id: "search", placeholder: "find a node", "aria-label": "find a node",
      title: "find nodes by name or type (/); Enter goes to the next one", oninput: () => this.find(0),
      onkeydown: (event) => {
        if (event.key === "Enter") this.find(event.shiftKey ? -1 : 1);
        if (event.key !== "Escape") return;
        this.search.value = "";
        this.find(0);
        this.search.blur();
        event.stopPropagation();
      } });
    tools.append(this.found, this.search);
    new ResizeObserver(() => this.size()).observe(root);
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

  // Returns the pixels per unit of the drawing at which all of it is visible.
  fit([width, height]) {
    return Math.min((this.root.clientHeight - 12) / (height + 16), (this.root.clientWidth - 20) / (width + 16)) / unit();
  }

  size() {
    if (!this.extent || this.root.clientWidth === 0) return;
    // Another width of the dock requires another layout.
    if (this.laidOut !== this.layout()) return this.draw();
    const drawing = this.root.querySelector("svg"), [width, height] = this.extent;
    const scale = unit() * this.scale * Math.min(1.2, Math.max(legible, this.fit(this.extent)));
    drawing.setAttribute("width", (width + 16) * scale);
    drawing.setAttribute("height", (height + 16) * scale);
  }

  // Returns the line width of our own layout; 0: Graphviz's, if all of it is legible.
  layout() {
    if (this.picture.size && (this.root.clientWidth === 0 || this.fit(this.picture.size) >= legible)) return 0;
    return Math.max(300, Math.floor((this.root.clientWidth || 1200) / unit() - 36));
  }

  show(picture, why) {
    this.picture = picture;
    if (!picture) {
      this.facts = null;
      this.extent = null;
      this.root.replaceChildren(element("p", { class: "quiet" }, why || "The graph is drawn after the first frame."));
      return;
    }
    this.draw();
  }

  draw() {
    const { picture } = this, drawing = svg("svg", { id: "graph" }), wide = this.layout();
    this.laidOut = wide;
    const nodes = picture.nodes.map((node) => ({ ...node })); // our own layout moves them
    if (wide === 0) this.drawPaths(drawing);
    else this.layOut(drawing, nodes, wide);
    const [width, height] = this.extent;
    drawing.setAttribute("viewBox", `-8 -8 ${width + 16} ${height + 16}`);
    this.facts = new Map();
    for (const node of nodes) {
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
    this.find(0);
    this.figures(this.statistics);
  }

  // Draws Graphviz's paths: Bézier curves with heads.
  drawPaths(drawing) {
    this.extent = this.picture.size;
    for (const edge of this.picture.edges) {
      if (!edge.path) continue;
      const [first, ...rest] = edge.path, head = rest[rest.length - 1], before = rest[rest.length - 2];
      drawing.append(svg("path", { class: edge.kind, d: `M${first} C${rest.slice(0, -1).join(" ")} L${head}` }));
      const angle = Math.atan2(head[1] - before[1], head[0] - before[0]);
      const corner = (turn, far) => [head[0] - far * Math.cos(angle + turn), head[1] - far * Math.sin(angle + turn)];
      drawing.append(svg("path", { class: "tip", d: `M${head} L${corner(0.4, 7)} L${corner(-0.4, 7)} Z` }));
    }
  }

  layOut(drawing, nodes, wide) {
    const { edges } = this.picture, { size, paths } = layOut(nodes, edges, wide);
    this.extent = size;
    edges.forEach((edge, k) => {
      const to = nodes[edge.to], x = to.x - to.width / 2;
      drawing.append(svg("path", { class: edge.kind, d: paths[k] }), svg("path", { class: "tip", d: `M${x},${to.y} l-6,-2.6 l0,5.2 Z` }));
    });
  }

  toggle(name) {
    this.chosen = this.chosen === name ? "" : name;
    this.mark();
    this.choose(this.chosen);
  }

  mark() {
    for (const [name, { group }] of this.facts ?? []) group.classList.toggle("chosen", name === this.chosen);
  }

  // Marks the nodes that match the search, and goes to the next or previous one.
  find(step) {
    const words = this.search.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const found = [];
    for (const { group, node } of this.facts?.values() ?? []) {
      const is = words.length > 0 && words.every((word) => `${node.name} ${node.type}`.toLowerCase().includes(word));
      group.classList.toggle("found", is);
      if (is) found.push(group);
    }
    this.at = found.length ? (((this.at ?? 0) + step) % found.length + found.length) % found.length : 0;
    if (step === 0) this.at = 0;
    this.found.textContent = words.length ? (found.length ? `${this.at + 1} of ${found.length}` : "none") : "";
    if (!found.length) return;
    found[this.at].scrollIntoView({ block: "nearest", inline: "nearest" });
    if (step) found[this.at].dispatchEvent(new Event("click"));
  }

  // Shows points and seconds of each node in a frame.
  figures(statistics) {
    this.statistics = statistics;
    if (!this.facts || !statistics?.nodes) return;
    const texts = new Map();
    for (const work of statistics.nodes)
      work.nodes.forEach((name, k) => texts.set(name, `${count(work.points)} · ${k === 0 ? seconds(work.seconds) : "fused"}`));
    // Sets only texts that have changed: each assignment lays out the page again.
    for (const [name, { fact, node }] of this.facts) {
      const text = texts.get(name) ?? node.type;
      if (fact.textContent !== text) fact.textContent = text;
    }
  }

  node(name) { return this.picture?.nodes.find((node) => node.name === name); }
}

function tip(node) {
  const lines = [`${node.name}: ${node.type}, ${node.file}:${node.line}`];
  for (const [name, value] of Object.entries(node.arguments)) lines.push(`  ${name} = ${value}`);
  for (const what of ["makes", "reads", "writes"]) if (node[what].length) lines.push(`${what} ${node[what].join(", ")}`);
  lines.push(node.kept ? `evaluated ${node.evaluated}${node.changes ? `; ${node.changes}` : ""}` : `pruned: ${node.why}`);
  return lines.join("\n");
}
