// Figures over frames: a curve each; a click goes to a frame.
import { element, prepare, colour, brief } from "./dom.js";

const energy = (f) => (f.ledger ? f.ledger.kinetic + f.ledger.potential + f.ledger.elastic : undefined);
const curves = [
  ["points", "", (f) => f.points],
  ["seconds a frame", "s", (f) => f.seconds?.total],
  ["seconds in solve", "s", (f) => f.seconds?.solve],
  ["estimated error, 95 %", "m", (f) => f.error?.position_p95],
  ["deepest penetration", "m", (f) => f.penetration_max],
  ["contacts", "", (f) => f.collisions],
  ["sub-steps", "", (f) => f.substeps],
  ["asleep", "", (f) => f.asleep],
  ["energy of constrained points", "J", energy],
  ["energy drift, largest", "J/kg", (f) => f.energy_drift?.max],
];

export class Figures {
  constructor(root, { go }) {
    this.root = element("div", { id: "figures" });
    root.append(this.root);
    this.known = [];
    this.charts = curves.map(([name, unit, read]) => {
      const canvas = element("canvas", { title: `${name}: a click goes to the frame` }), value = element("span", { class: "number" });
      const chart = { name, unit, read, canvas, value, box: element("figure", { hidden: true }, element("figcaption", {}, name, value), canvas) };
      canvas.addEventListener("click", (event) => {
        const box = canvas.getBoundingClientRect();
        go(Math.round(this.first + ((event.clientX - box.left) / box.width) * (this.last - this.first)));
      });
      this.root.append(chart.box);
      return chart;
    });
    new ResizeObserver(() => this.draw()).observe(this.root);
  }

  of(frame) { return this.known.find((f) => f.frame === frame); }

  // statistics: of all frames, in order.
  show(statistics, first, last, frame) {
    Object.assign(this, { known: statistics, first, last, frame });
    this.draw();
  }

  draw() {
    if (this.root.offsetParent === null) return;
    for (const chart of this.charts) {
      const values = this.known.map((f) => [f.frame, chart.read(f)]).filter(([, v]) => typeof v === "number");
      chart.box.hidden = values.length === 0 || values.every(([, v]) => v === 0);
      if (chart.box.hidden) continue;
      const { context, width, height } = prepare(chart.canvas), most = Math.max(...values.map(([, v]) => v)), least = Math.min(0, ...values.map(([, v]) => v));
      const x = (f) => ((f - this.first) / Math.max(1, this.last - this.first)) * width, y = (v) => height - 2 - ((v - least) / (most - least || 1)) * (height - 6);
      context.strokeStyle = colour("line");
      context.strokeRect(0, y(0), width, 0);
      context.strokeStyle = colour("accent");
      context.lineWidth = 1.3;
      context.beginPath();
      values.forEach(([f, v], i) => (i ? context.lineTo(x(f), y(v)) : context.moveTo(x(f), y(v))));
      context.stroke();
      context.fillStyle = colour("quiet");
      context.fillRect(x(this.frame), 0, 1, height);
      const here = values.find(([f]) => f === this.frame);
      chart.value.textContent = `${here ? brief(here[1]) : "–"} of ${brief(most)} ${chart.unit}`;
    }
  }
}
