// Lays out graphs from left to right, if Graphviz has not: large ones, and in a sandbox. A graph that is too wide
// continues on another line, as text does.

const gapX = 34, gapY = 12, gapLine = 34, high = 34, margin = 12;
const lanes = { flow: 0, source: 5, feedback: -5 }; // for edges between two lines

const widthOf = (node) => Math.max(88, 7 * Math.max(node.name.length, node.type.length) + 18);

// Gives the nodes x, y, width and height, and returns the size of all and an SVG path for each edge. widest: width of a
// line.
export function layOut(nodes, edges, widest) {
  const forward = edges.filter((edge) => edge.kind !== "feedback");
  const layers = layersOf(nodes.length, forward);
  order(layers, forward);
  // Places layers from the left, line by line.
  const line = new Array(nodes.length).fill(0);
  let x = margin, y = 0, tallest = 0, wide = 0, number = 0;
  const lines = [];
  for (const layer of layers) {
    const across = Math.max(...layer.map((i) => widthOf(nodes[i]))), tall = layer.length * (high + gapY) - gapY;
    if (x > margin && x + across > widest) {
      lines.push({ y, tall: tallest });
      y += tallest + gapLine;
      x = margin;
      tallest = 0;
      ++number;
    }
    layer.forEach((i, k) => {
      Object.assign(nodes[i], { x: x + across / 2, y: y + k * (high + gapY) + high / 2, width: widthOf(nodes[i]), height: high });
      line[i] = number;
    });
    x += across + gapX;
    wide = Math.max(wide, x - gapX);
    tallest = Math.max(tallest, tall);
  }
  lines.push({ y, tall: tallest });
  const paths = edges.map(({ from, to, kind }) => {
    const a = nodes[from], b = nodes[to], ax = a.x + a.width / 2, bx = b.x - b.width / 2;
    if (line[from] === line[to] && bx > ax) {
      // Crosses at the lower of the two, where fewer nodes are in the way.
      const turn = a.y > b.y ? bx - gapX : ax, middle = turn + gapX / 2;
      return `M${ax},${a.y} L${turn},${a.y} C${middle},${a.y} ${middle},${b.y} ${turn + gapX},${b.y} L${bx},${b.y}`;
    }
    // Follows the gap below the line that it leaves or, if it goes backward, below the line that it enters.
    const at = lines[Math.min(line[from], line[to])], between = at.y + at.tall + gapLine / 2 + (lanes[kind] ?? 0), out = ax + gapX / 3, into = bx - gapX / 3;
    return `M${ax},${a.y} L${out},${a.y} L${out},${between} L${into},${between} L${into},${b.y} L${bx},${b.y}`;
  });
  return { size: [wide, y + tallest + gapLine], paths };
}

// Returns layers in which each node comes after those that feed it.
function layersOf(count, edges) {
  const after = Array.from({ length: count }, () => []), missing = new Array(count).fill(0), depth = new Array(count).fill(0);
  for (const { from, to } of edges) { after[from].push(to); ++missing[to]; }
  const ready = missing.flatMap((n, i) => (n === 0 ? [i] : []));
  for (let k = 0; k < ready.length; ++k)
    for (const to of after[ready[k]]) {
      depth[to] = Math.max(depth[to], depth[ready[k]] + 1);
      if (--missing[to] === 0) ready.push(to);
    }
  const layers = [];
  depth.forEach((d, i) => (layers[d] ??= []).push(i));
  return layers.filter(Boolean);
}

// Orders each layer by the positions of its inputs, so that few edges cross.
function order(layers, edges) {
  const before = new Map();
  for (const { from, to } of edges) before.set(to, [...(before.get(to) ?? []), from]);
  const place = new Map();
  for (const layer of layers) {
    const mean = (i) => { const list = (before.get(i) ?? []).filter((j) => place.has(j)); return list.length ? list.reduce((sum, j) => sum + place.get(j), 0) / list.length : Infinity; };
    const wishes = new Map(layer.map((i) => [i, mean(i)]));
    layer.sort((a, b) => wishes.get(a) - wishes.get(b) || a - b);
    layer.forEach((i, k) => place.set(i, k));
  }
}
