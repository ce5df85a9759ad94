// Charts over frames, with one or more curves each. A click goes to a frame.
import { element, prepare, colour, brief, seconds, unit } from "./dom.js";

// The drawn value of a figure that has several.
const parts = {
  seconds: (f) => f.seconds?.total,
  error: (f) => f.error?.position_p95,
  energy_drift: (f) => f.energy_drift?.max,
  ledger: (f) => f.ledger && f.ledger.kinetic + f.ledger.potential + f.ledger.elastic,
};
const stages = [["solve", "accent", (f) => f.seconds?.solve], ["scripts", "good", (f) => f.seconds?.script], ["graph", "warn", (f) => f.seconds?.graph]];

// Returns name, unit and lines of each chart: a line has a name, a colour and its value in a frame.
function chartsOf(listed) {
  return listed.flatMap(({ key, title, unit }) => {
    const chart = [title, unit, [["", "accent", parts[key] ?? ((f) => f[key])]]];
    return key === "seconds" ? [chart, ["", unit, stages]] : [chart];
  });
}

export class Figures {
  constructor(root, { go }) {
    this.root = element("div", { id: "figures" });
    root.append(this.root);
    this.go = go;
    this.byFrame = new Map();
    this.declare([]);
    new ResizeObserver(() => this.draw()).observe(this.root);
  }

  // listed: key, title and unit of each figure with a chart, from the server.
  declare(listed) {
    if (this.charts?.length) return;
    this.known = null;
    this.charts = chartsOf(listed).map(([name, unitName, lines]) => {
      const canvas = element("canvas", { title: `${name || "seconds by stage"}: click to go to a frame` }), value = element("span", { class: "number" });
      const names = lines.map(([line, tint]) => element("span", { class: line ? `line ${tint}` : "" }, line || name));
      const chart = { name, unitName, lines, curves: [], names, canvas, value, box: element("figure", { hidden: true }, element("figcaption", {}, ...names, element("span", { class: "gap" }), value), canvas) };
      canvas.addEventListener("click", (event) => {
        const box = canvas.getBoundingClientRect();
        this.go(Math.round(this.first + ((event.clientX - box.left) / box.width) * (this.last - this.first)));
      });
      this.root.append(chart.box);
      return chart;
    });
    this.know([]);
  }

  of(frame) { return this.byFrame.get(frame); }

  // statistics: of all frames, in order; the list grows, or is replaced.
  know(statistics) {
    if (statistics !== this.known) {
      this.known = statistics;
      this.byFrame.clear();
      for (const chart of this.charts) chart.curves = chart.lines.map(() => ({ values: [], least: 0, high: -Infinity, isZero: true }));
    }
    // Each frame is read once: with ten thousand, reading all of them for every shown frame was slow.
    for (let k = this.byFrame.size; k < statistics.length; ++k) {
      const f = statistics[k];
      this.byFrame.set(f.frame, f);
      for (const { lines, curves } of this.charts)
        lines.forEach(([, , read], line) => {
          const curve = curves[line], v = read(f);
          if (typeof v !== "number") return;
          curve.values.push([f.frame, v]);
          curve.least = Math.min(curve.least, v);
          curve.high = Math.max(curve.high, v);
          curve.isZero &&= v === 0;
        });
    }
  }

  show(statistics, first, last, frame) {
    this.know(statistics);
    Object.assign(this, { first, last, frame });
    this.draw();
  }

  draw() {
    if (this.root.offsetParent === null) return;
    const shown = [];
    for (const chart of this.charts) {
      chart.box.hidden = chart.curves.every((curve) => curve.isZero);
      if (!chart.box.hidden) shown.push(chart);
    }
    // Fills rows, with no gap at the end.
    const most = Math.max(1, Math.floor(this.root.clientWidth / (22 * 12 * unit()))), rows = Math.ceil(shown.length / most);
    const columns = Math.max(1, Math.ceil(shown.length / Math.max(1, rows)));
    this.root.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    shown.forEach(({ box }, k) => { box.style.gridColumn = k === shown.length - 1 ? `span ${1 + columns * rows - shown.length}` : ""; });
    for (const chart of shown) this.drawCurves(chart);
  }

  drawCurves(chart) {
    const { curves } = chart, high = Math.max(...curves.map((curve) => curve.high)), least = Math.min(...curves.map((curve) => curve.least));
    const { context, width, height } = prepare(chart.canvas);
    const x = (f) => ((f - this.first) / Math.max(1, this.last - this.first)) * width, y = (v) => height - 2 - ((v - least) / (high - least || 1)) * (height - 6);
    context.strokeStyle = colour("line");
    context.strokeRect(0, y(0), width, 0);
    context.lineWidth = 1.3;
    curves.forEach(({ values }, k) => {
      context.strokeStyle = colour(chart.lines[k][1]);
      context.beginPath();
      // For frames that share a column of pixels, the least and the largest value.
      for (let i = 0; i < values.length;) {
        const column = Math.floor(x(values[i][0]));
        let low = values[i][1], top = low;
        const from = low;
        for (++i; i < values.length && Math.floor(x(values[i][0])) === column; ++i) { low = Math.min(low, values[i][1]); top = Math.max(top, values[i][1]); }
        const at = x(values[i - 1][0]);
        context.lineTo(at, y(from));
        if (low !== top) { context.lineTo(at, y(low)); context.lineTo(at, y(top)); context.lineTo(at, y(values[i - 1][1])); }
      }
      context.stroke();
    });
    context.fillStyle = colour("quiet");
    context.fillRect(x(this.frame), 0, 1, height);
    const now = this.of(this.frame), text = (v) => (typeof v !== "number" ? "–" : chart.unitName === "s" ? seconds(v) : brief(v));
    const here = chart.lines.map(([, , read]) => text(now && read(now))), most = chart.unitName === "s" ? seconds(high) : `${brief(high)} ${chart.unitName}`;
    chart.value.textContent = here.length === 1 ? `${here[0]} of ${most}` : `of ${most}`;
    // If there are several lines, each is followed by its value; one that is always 0 has neither.
    if (here.length > 1)
      chart.lines.forEach(([line], k) => {
        chart.names[k].hidden = curves[k].isZero;
        chart.names[k].textContent = `${line} ${here[k]}`;
      });
  }
}
