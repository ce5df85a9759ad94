// The borders of the column and the dock: dragged, or moved by the arrow keys, and stored for the next time. A double
// click restores the default. The picture may fill the window.
import { element } from "./dom.js";

const least = 120, step = 24; // pixels

// A panel's border. Its size grows against the axis, to the left or upward.
function border(work, panel, { name, axis, title }) {
  const bar = element("div", { class: `border ${axis}`, role: "separator", tabindex: 0, "aria-label": title, title,
    "aria-orientation": axis === "x" ? "vertical" : "horizontal" });
  const size = () => panel.getBoundingClientRect()[axis === "x" ? "width" : "height"];
  const room = () => work.getBoundingClientRect()[axis === "x" ? "width" : "height"] - 2 * least;
  const set = (pixels) => {
    if (pixels === null) work.style.removeProperty(`--${name}`);
    else work.style.setProperty(`--${name}`, `${Math.round(Math.min(Math.max(pixels, least), room()))}px`);
    try { pixels === null ? localStorage.removeItem(name) : localStorage.setItem(name, size()); } catch { /* a browser that keeps nothing */ }
  };
  let held = null;
  bar.addEventListener("pointerdown", (event) => {
    bar.setPointerCapture(event.pointerId);
    held = { at: axis === "x" ? event.clientX : event.clientY, size: size() };
  });
  bar.addEventListener("pointermove", (event) => { if (held) set(held.size + held.at - (axis === "x" ? event.clientX : event.clientY)); });
  bar.addEventListener("pointerup", () => { held = null; });
  bar.addEventListener("dblclick", () => set(null));
  bar.addEventListener("keydown", (event) => {
    const by = { x: { ArrowLeft: step, ArrowRight: -step }, y: { ArrowUp: step, ArrowDown: -step } }[axis][event.key];
    if (by) set(size() + by);
  });
  work.append(bar);
  try { const kept = Number(localStorage.getItem(name)); if (kept) set(kept); } catch { /* none */ }
}

export class Panels {
  constructor(work, side, dock) {
    this.work = work;
    border(work, side, { name: "side", axis: "x", title: "the width of the column: drag it or use the arrow keys; double-click for the default" });
    border(work, dock, { name: "dock", axis: "y", title: "the height of the dock: drag it or use the arrow keys; double-click for the default" });
  }

  // Shows the picture alone, or with all panels.
  toggle() { this.work.classList.toggle("alone"); }
}
