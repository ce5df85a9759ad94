// Creates elements of the page. Text is always text: no name of a scene becomes HTML.

// element("button", { title: "...", onclick: f, class: "small" }, child or text, ...)
export function element(tag, properties = {}, ...children) {
  return fill(document.createElement(tag), properties, children);
}

export function svg(tag, properties = {}, ...children) {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), properties, children);
}

function fill(made, properties, children) {
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "hidden") made[name] = value;
    else if (value !== undefined && value !== false) made.setAttribute(name, value);
  }
  for (const child of children) if (child !== undefined && child !== null) made.append(child);
  return made;
}

export const by = (id) => document.getElementById(id);

// Returns a number in few characters.
export function brief(x) {
  if (typeof x !== "number") return String(x);
  if (Number.isInteger(x) && Math.abs(x) < 1e7) return x.toLocaleString("en-US").replaceAll(",", " ");
  const size = Math.abs(x);
  return size !== 0 && (size < 1e-3 || size >= 1e6) ? x.toExponential(2) : String(Number(x.toPrecision(4)));
}

// Returns a 32-bit value with just enough digits to distinguish it from all others.
export function exact(value) {
  if (Array.isArray(value)) return value.map(exact).join("  ");
  if (typeof value !== "number" || Number.isInteger(value)) return String(value);
  let short;
  for (let digits = 6; digits <= 9; ++digits) {
    short = Number(value.toPrecision(digits));
    if (Math.fround(short) === Math.fround(value)) break;
  }
  return Math.abs(short) < 1e-3 ? short.toExponential() : String(short);
}

// Returns a count short enough for a node.
export function count(n) {
  if (n < 1e5) return brief(n);
  return n < 999500 ? `${Math.round(n / 1e3)} k` : `${(n / 1e6).toPrecision(3)} M`;
}

export function bytes(count) {
  const units = ["B", "KiB", "MiB", "GiB"];
  let unit = 0;
  while (count >= 1024 && unit < 3) { count /= 1024; ++unit; }
  return `${count < 10 && unit > 0 ? count.toFixed(1) : Math.round(count)} ${units[unit]}`;
}

export function seconds(time) {
  if (time < 1e-3) return `${Math.round(time * 1e6)} µs`;
  return time < 1 ? `${(time * 1e3).toPrecision(3)} ms` : `${time.toPrecision(3)} s`;
}

// Returns the scale of text relative to the default.
export const unit = () => parseFloat(getComputedStyle(document.documentElement).fontSize) / 12;

// Returns the context of a canvas at the screen's resolution, and its size in CSS pixels.
export function prepare(canvas) {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, box.width, box.height);
  return { context, width: box.width, height: box.height };
}

export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
