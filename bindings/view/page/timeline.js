// The timeline: ready, stale and missing frames; the shown frame; playing.
import { element, prepare, colour, unit } from "./dom.js";

export class Timeline {
  // go(frame): the user chose a frame; play(on).
  constructor(root, { go, play, step }) {
    this.go = go;
    this.canvas = element("canvas", { title: "Click or drag to go to a frame. Green frames are computed, ochre ones are from the previous run, the blue one is being computed. Marks show warnings.", "aria-label": "frames" });
    this.playing = element("button", { id: "play", title: "play, pause (Space)", onclick: () => play() }, "▶");
    this.field = element("input", { type: "number", id: "frame", title: "the frame shown", onchange: () => go(Number(this.field.value)) });
    this.text = element("span", { class: "number quiet", id: "rate" });
    root.append(
      element("button", { title: "first frame (Home)", onclick: () => go(this.first) }, "|◀"),
      element("button", { title: "one frame back (←)", onclick: () => step(-1) }, "◂"),
      this.playing,
      element("button", { title: "one frame forward (→)", onclick: () => step(1) }, "▸"),
      element("button", { title: "last frame (End)", onclick: () => go(this.last) }, "▶|"),
      this.field, this.canvas, this.text);
    this.first = this.last = this.frame = 1;
    this.ready = [];
    this.stale = [];
    this.warned = [];
    const at = (event) => {
      const box = this.canvas.getBoundingClientRect();
      const part = (event.clientX - box.left - 6) / (box.width - 12);
      go(Math.round(this.first + Math.min(Math.max(part, 0), 1) * (this.last - this.first)));
    };
    this.canvas.addEventListener("pointerdown", (event) => { this.canvas.setPointerCapture(event.pointerId); this.held = true; at(event); });
    this.canvas.addEventListener("pointermove", (event) => { if (this.held) at(event); });
    this.canvas.addEventListener("pointerup", () => { this.held = false; });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  show(status) {
    Object.assign(this, { first: status.first, last: status.last, ready: status.ready, stale: status.stale,
      computing: ["starting", "computing"].includes(status.state), warned: status.warnings.map((warning) => warning.frame).filter((frame) => frame > 0) });
    this.field.min = status.first;
    this.field.max = status.last;
    this.draw();
  }

  at(frame, isPlaying, text) {
    this.frame = frame;
    if (document.activeElement !== this.field) this.field.value = frame;
    this.playing.textContent = isPlaying ? "⏸" : "▶";
    this.playing.setAttribute("aria-pressed", isPlaying);
    this.text.textContent = text;
    this.draw();
  }

  draw() {
    const { context, width, height } = prepare(this.canvas), span = Math.max(1, this.last - this.first), room = width - 12;
    const x = (frame) => 6 + ((frame - this.first) / span) * room, half = room / span / 2;
    const u = unit(), top = height - 9 * u, thick = 6 * u;
    context.fillStyle = colour("raised");
    context.fillRect(6 - half, top, room + 2 * half, thick);
    for (const [list, name] of [[this.stale, "stale"], [this.ready, "good"]]) {
      context.fillStyle = colour(name);
      for (const [a, b] of list) context.fillRect(x(a) - half, top, x(b) - x(a) + 2 * half, thick);
    }
    if (this.computing) { // the frame being computed
      const next = this.ready.length ? this.ready[this.ready.length - 1][1] + 1 : this.first;
      context.fillStyle = colour("accent");
      if (next <= this.last) context.fillRect(x(next) - half, top, Math.max(2 * half, 4 * u), thick);
    }
    context.fillStyle = colour("warn");
    for (const frame of this.warned) context.fillRect(x(frame) - 1, top - 4, 2, 4);
    context.fillStyle = colour("quiet");
    context.font = `${10 * u}px system-ui, sans-serif`;
    const wish = span / Math.max(1, room / (70 * u)), step = [1, 2, 5, 10, 20, 24, 48, 50, 100, 200, 500, 1000, 2000, 5000].find((s) => s >= wish) ?? 10000;
    // The shown frame, on its mark. Labels avoid it, and the ends.
    context.textAlign = "center";
    const wideOf = (text) => context.measureText(text).width / 2, within = (text, at) => Math.min(Math.max(at, wideOf(text)), width - wideOf(text));
    const shown = String(this.frame), middle = within(`  ${shown}`, x(this.frame)), reach = wideOf(`  ${shown}`);
    for (let frame = Math.ceil(this.first / step) * step; frame <= this.last; frame += step) {
      context.fillRect(x(frame), top - 3, 1, 3);
      if (Math.abs(within(frame, x(frame)) - middle) > reach + wideOf(frame) + 2 * u) context.fillText(frame, within(frame, x(frame)), top - 6);
    }
    context.fillStyle = colour("accent");
    context.fillRect(x(this.frame) - u, top - 6, 2 * u, height - top + 6);
    context.fillRect(middle - reach, top - 15 * u - 2, 2 * reach, 12 * u);
    context.fillStyle = colour("panel");
    context.fillText(shown, middle, top - 6);
  }
}
