// The page: its state, and the communication between its parts.
import { Connection } from "./connection.js";
import { Picture } from "./picture.js";
import { Timeline } from "./timeline.js";
import { Parameters } from "./parameters.js";
import { Graph } from "./graph.js";
import { Inspector } from "./point.js";
import { Figures } from "./figures.js";
import { Sheet } from "./sheet.js";
import { Out } from "./out.js";
import { Rendered } from "./rendered.js";
import { ramp } from "./ramp.js";
import { Panels } from "./panels.js";
import { bindKeys, showKeys } from "./keys.js";
import { element, by, brief, bytes, colour } from "./dom.js";

const cacheBytes = 300e6, ahead = 4;
const state = {
  status: null, frame: NaN, run: 0, follow: true, playing: false, output: "", colour: "", group: "", after: "",
  style: "discs", trails: 0, point: null, life: null, statistics: [], statisticsRun: 0,
};
const cache = new Map(); // messages of frames, by the request that they answer
let cached = 0;

const connection = new Connection({
  lost() { note("The server does not answer; waiting for it. If you have started it again, use the new address that rapid view printed."); },
  found() { note(""); },
});
history.replaceState(null, "", "/"); // the connection has the token
const ask = (what, given) => connection.ask(what, given);

function note(text) { by("note").textContent = text; }

function openPicture() {
  try {
    return new Picture(by("canvas"));
  } catch (error) {
    showProblem("The picture needs WebGL, which this browser does not have.", error.message,
      "Try another browser, or install the driver of the graphics card. If you are connected by ssh, run the browser on your own machine.");
    throw error;
  }
}

// ---- the parts ----

const picture = openPicture();
const timeline = new Timeline(by("timeline"), { go: (frame) => go(frame), play: () => play(), step: (by_) => go(state.frame + by_) });
const parameterPart = element("section", { id: "parameters" });
by("side").append(parameterPart);
const parameters = new Parameters(parameterPart, { change: (values) => ask("set", { values }).catch(tell), copy });
const out = new Out(by("side"), {
  ask, tell: flash, close: () => openOut(false),
  shown: () => ({ ...shown(), camera: cameraNumbers() }),
  size: () => [by("canvas").width, by("canvas").height],
  title: () => state.status.title.replace(/^.*\//, "").replace(/\.\w+$/, "").replace(/[#.]+$/, ""),
});
const inspector = new Inspector(by("side"), {
  go: (frame) => go(frame),
  trace: (id) => trace(id),
  close(what) {
    if (what === "point") choosePoint(null);
    else if (what === "node") graph.toggle(graph.chosen);
    else inspector.hide(what);
  },
});

// The page's own marks would be covered, and so would chosen colours and groups.
const rendered = new Rendered(by("rendered"), {
  ask: (wish) => ask("picture", wish), tell,
  wish() {
    const { width, height } = by("canvas"), isMarked = state.point !== null || state.trails || state.colour || state.group;
    if (state.style !== "picture" || isMarked || state.playing || !isThere(state.frame)) return null;
    return Math.min(width, height) < 16 ? null : { ...shown(), camera: cameraNumbers(), width, height };
  },
});
picture.onchange = () => rendered.change();

const panels = new Panels(by("work"), by("side"), by("dock"));
const tabs = {};
const nav = element("nav", { role: "tablist" });
by("dock").append(nav);
for (const [name, title] of [["graph", "Graph"], ["figures", "Figures"], ["sheet", "Spreadsheet"]]) {
  const panel = element("div", { role: "tabpanel", "aria-label": title, hidden: true, id: `${name}-panel` });
  const button = element("button", { role: "tab", id: `${name}-tab`, title: `${title} (${"gfs"["gfs".indexOf(name[0])].toUpperCase()} with Alt)`, onclick: () => openTab(name) }, title);
  nav.append(button);
  by("dock").append(panel);
  tabs[name] = { panel, button };
}
const tools = element("span", { class: "tools", id: "graph-tools" });
nav.append(element("span", { class: "gap" }), element("span", { class: "quiet", id: "dock-note", role: "status" }), tools);
const graph = new Graph(tabs.graph.panel, tools, { choose: (node) => chooseNode(node) });
const figures = new Figures(tabs.figures.panel, { go: (frame) => go(frame) });
const sheet = new Sheet(tabs.sheet.panel, {
  rows: (from, count, sort, descending) => ask("sheet", { ...shown(), from, count, sort, descending }),
  pick: (id) => choosePoint(id),
});

function openTab(name) {
  for (const [other, { panel, button }] of Object.entries(tabs)) {
    panel.hidden = other !== name;
    button.setAttribute("aria-selected", other === name);
  }
  tools.hidden = name !== "graph";
  graph.size();
  figures.draw();
  if (name === "sheet") sheet.refresh();
}

// ---- the bar ----

const choices = (list) => list.map(([value, text]) => element("option", { value }, text));
const bar = {
  title: element("h1", {}, ""),
  state: element("span", { id: "state" }, "starting"),
  output: element("select", { id: "output", title: "the output to show", onchange: () => { state.output = bar.output.value; change(); } }),
  colour: element("select", { id: "colour", title: "colour by an attribute (C)", onchange: () => { state.colour = bar.colour.value; change(); } }),
  group: element("select", { id: "group", title: "show only the points of a group", onchange: () => { state.group = bar.group.value; change(); } }),
  style: element("select", { id: "style", title: "how points are drawn (D)", onchange: () => { state.style = bar.style.value; change(); } },
    ...choices([["discs", "spheres"], ["dots", "dots"], ["streaks", "streaks"], ["picture", "in pictures"]])),
  shapes: element("button", { id: "shapes", title: "colliders and emitters (S)", "aria-pressed": true, onclick: () => toggle("shapes") }, "shapes"),
  ground: element("button", { id: "ground", title: "grid and axes (G)", "aria-pressed": true, onclick: () => toggle("ground") }, "grid"),
  trails: element("select", { id: "trails", title: "positions of the points in earlier frames (T)", onchange: () => { state.trails = Number(bar.trails.value); showTrails(); } },
    ...choices([["0", "no trails"], ["6", "6 frames"], ["12", "12 frames"], ["24", "24 frames"], ["48", "48 frames"], ["1000", "all frames"]])),
};
by("bar").append(bar.title, bar.state, element("span", { class: "gap" }), bar.output,
  element("label", { for: "colour" }, "colour"), bar.colour, element("label", { for: "group" }, "group"), bar.group,
  element("label", { for: "style" }, "as"), bar.style, bar.shapes, bar.ground, bar.trails,
  element("button", { id: "fit", title: "show everything (F)", onclick: () => picture.fit() }, "fit"),
  element("button", { id: "camera", title: "copy the camera for --camera, or paste one (K)", onclick: () => openCamera() }, "camera"),
  element("button", { id: "save", title: "pictures and films (O)", "aria-pressed": false, onclick: () => openOut(!out.root.hidden ? false : true) }, "export"),
  element("button", { id: "theme", title: "dark or light (L)", onclick: () => theme(document.documentElement.dataset.theme === "light" ? "dark" : "light") }, "◐"),
  element("button", { id: "help", title: "all keys (?)", onclick: () => showKeys() }, "?"));

function press(button, on) { button.setAttribute("aria-pressed", Boolean(on)); }

function toggle(what) {
  picture[what].visible = !picture[what].visible;
  press(bar[what], picture[what].visible);
  picture.draw();
}

function theme(name) {
  document.documentElement.dataset.theme = name;
  try { localStorage.setItem("theme", name); } catch { /* a browser that keeps nothing */ }
  picture.theme(colour("picture"), colour("line"));
  timeline.draw();
  figures.draw();
  if (state.point !== null) showPoint(); // its curves
}

// advice: says what to do with the text.
function copy(text, advice) {
  if (!text) return flash("nothing to copy: no parameter was changed");
  const message = `${text}; ${advice}`;
  navigator.clipboard?.writeText(text).then(() => flash(`copied: ${message}`), () => flash(message));
  if (!navigator.clipboard) flash(message);
}

function flash(text) { by("dock-note").textContent = text; }
function tell(error) { flash(error.message ?? String(error)); }

// ---- frames ----

// The page's camera, or undefined while it looks through the scene's, which the server knows.
const cameraNumbers = () => (picture.isSceneCamera ? undefined : picture.cameraText().split(",").map(Number));
const shown = () => ({ frame: state.frame, output: state.output || undefined, group: state.group, after: state.after });
const wishes = (frame) => ({ frame, output: state.output || undefined, colour: state.colour, group: state.group, velocities: state.style === "streaks", after: state.after });
const isReady = (frame) => state.status.ready.some(([a, b]) => frame >= a && frame <= b);
const isThere = (frame) => isReady(frame) || state.status.stale.some(([a, b]) => frame >= a && frame <= b);
const newest = () => (state.status.ready.length ? state.status.ready[state.status.ready.length - 1][1] : NaN);
const key = (frame) => JSON.stringify([wishes(frame), isReady(frame), state.status.run]);

async function fetchFrame(frame) {
  const name = key(frame);
  const known = cache.get(name);
  if (known) { cache.delete(name); cache.set(name, known); return known; }
  const pending = ask("frame", wishes(frame));
  cache.set(name, pending);
  try {
    const message = await pending;
    cached += message.bytes;
    message.key = name;
    for (const [old, value] of cache) {
      if (cached <= cacheBytes) break;
      if (old === name) continue;
      const done = await Promise.race([value, null]);
      if (done) { cached -= done.bytes; cache.delete(old); }
    }
    return message;
  } catch (error) {
    cache.delete(name);
    throw error;
  }
}

let wanted = 0;
async function show(frame, fresh = false) {
  const serial = ++wanted;
  const first = Number.isNaN(state.frame);
  state.frame = frame;
  tellTime();
  if (!isThere(frame)) return;
  let message;
  try {
    message = await fetchFrame(frame);
  } catch (error) {
    if (serial === wanted && !/not computed/.test(error.message)) tell(error);
    return;
  }
  if (serial !== wanted) return;
  picture.style = state.style === "picture" ? "discs" : state.style;
  picture.shutter = 0.5 / state.status.fps;
  picture.show(message);
  state.shownRun = message.run;
  state.shownFrame = frame;
  if (message.shown > 0) state.firstPoints ??= performance.now();
  document.body.dataset.frame = frame;
  document.body.dataset.run = message.run;
  document.body.dataset.shown = message.shown;
  showLegend(message);
  note(`${brief(message.total)} points${message.shown < message.total ? `, ${brief(message.shown)} shown${message.every > 1 ? ` (ids that are multiples of ${message.every})` : ""}` : ""}${state.after ? ` after ${state.after}` : ""}`);
  ask("shapes", { ...shown(), known: picture.knownMeshes(), ...picture.size() }).then((shapes) => {
    if (serial !== wanted) return;
    picture.showShapes(shapes);
    picture.sceneCamera = shapes.camera ?? null;
    if (!state.fitted && (message.shown > 0 || shapes.bodies.length)) {
      state.fitted = message.shown > 0;
      if (shapes.camera) picture.followScene();
      else picture.fit();
    } else if (picture.isSceneCamera) {
      picture.followScene();
    }
  }, () => {});
  if (first || fresh || !state.playing) refreshDetails();
  drawFigures();
  tellFrame();
}

// Reports the frame's own figures.
function tellFrame() {
  const figure = figures.of(state.frame);
  graph.figures(figure);
  inspector.frame(state.frame, figure, state.status, figures.charts);
}

// Refreshes the frame's details besides its points.
function refreshDetails() {
  if (!tabs.sheet.panel.hidden) sheet.refresh();
  if (state.point !== null) showPoint();
  if (state.after) showNode();
  showTrails();
}

function change() {
  if (!Number.isNaN(state.frame)) show(state.frame, true);
}

function go(frame, keep = false) {
  if (!Number.isFinite(frame)) return;
  if (!keep) { state.follow = false; }
  if (state.playing && !keep) stop();
  show(Math.min(Math.max(Math.round(frame), state.status.first), state.status.last), true);
}

// ---- playing ----

let playFrom = 0, playFrame = 0, drawnFrames = 0;

function play() {
  if (state.playing) return stop();
  state.playing = true;
  state.follow = false;
  if (state.frame >= newest()) state.frame = state.status.first;
  playFrom = performance.now();
  playFrame = state.frame;
  drawnFrames = 0;
  requestAnimationFrame(advance);
  tellTime();
}

function stop() {
  state.playing = false;
  tellTime();
  refreshDetails();
}

async function advance() {
  if (!state.playing) return;
  const end = newest(), now = performance.now();
  let frame = playFrame + Math.floor(((now - playFrom) / 1000) * state.status.fps);
  // A browser that is too slow skips frames, up to a quarter of a second.
  const furthest = state.frame + Math.max(1, Math.round(state.status.fps / 4));
  if (frame > furthest) {
    frame = playFrame = furthest;
    playFrom = now;
  }
  if (frame > end) {
    // At the end, playing restarts from the beginning; during computation, the newest frame waits for the next.
    if (state.status.state !== "computing") frame = state.status.first;
    else frame = end;
    playFrame = frame;
    playFrom = now;
  }
  if (frame !== state.frame && isThere(frame)) {
    await show(frame);
    ++drawnFrames;
    for (let next = frame + 1; next <= Math.min(frame + ahead, end); ++next) fetchFrame(next).catch(() => {});
  }
  requestAnimationFrame(advance);
}

let rateFrom = 0;
setInterval(() => {
  if (state.playing) {
    const now = performance.now();
    state.rate = (1000 * drawnFrames) / (now - (rateFrom || now - 1000));
    rateFrom = now;
    drawnFrames = 0;
    tellTime();
  } else {
    rateFrom = 0;
  }
}, 1000);

function tellTime() {
  const time = (state.frame - state.status.first) / state.status.fps;
  timeline.at(state.frame, state.playing, state.playing && rateFrom ? `${state.rate.toFixed(0)} of ${brief(state.status.fps)} fps` : `${time.toFixed(3)} s`);
}

// ---- points, nodes, regions ----

function choosePoint(id) {
  state.point = id;
  state.life = null;
  sheet.chosen = id;
  if (!tabs.sheet.panel.hidden) sheet.load();
  if (id === null) {
    inspector.hide("point");
    picture.mark(null);
    return;
  }
  showPoint();
}

async function showPoint() {
  const id = state.point;
  try {
    const row = await ask("point", { ...shown(), id });
    const { path } = await ask("path", { id, output: state.output || undefined });
    if (id !== state.point) return;
    inspector.point(id, row, state.status.sequence ? "" : state.life, path, state.frame);
    picture.mark(row.values.P, path.map(([, ...place]) => place.slice(0, 3)));
  } catch (error) {
    if (id !== state.point) return;
    inspector.point(id, { values: { id, state: error.message }, groups: [] }, state.status.sequence ? "" : state.life);
    picture.mark(null);
  }
}

picture.onpick = async (row) => {
  if (row < 0) return choosePoint(null);
  try {
    const found = await ask("point", { ...shown(), row });
    choosePoint(found.values.id);
  } catch (error) {
    tell(error);
  }
};

async function trace(id) {
  state.life = "being computed …";
  showPoint();
  try {
    const { lives } = await ask("trace", { id, frame: state.frame, output: state.output || undefined, last: Math.max(newest() || 1, state.frame) });
    if (id !== state.point) return;
    state.life = lives[0] ?? "No point has this id.";
  } catch (error) {
    state.life = error.message;
  }
  showPoint();
}

function chooseNode(name) {
  state.after = name;
  if (name) showNode();
  else inspector.hide("node");
  change();
}

async function showNode() {
  const name = state.after, node = graph.node(name);
  if (!node) return;
  try {
    const { arguments: all } = await ask("arguments", { frame: state.frame });
    if (name === state.after) inspector.node(node, all[name]);
  } catch {
    inspector.node(node);
  }
}

picture.onregion = async ([x0, y0, x1, y1], done) => {
  const box = by("view").getBoundingClientRect(), mark = by("rectangle");
  mark.hidden = done;
  mark.style.left = `${Math.min(x0, x1) - box.left}px`;
  mark.style.top = `${Math.min(y0, y1) - box.top}px`;
  mark.style.width = `${Math.abs(x1 - x0)}px`;
  mark.style.height = `${Math.abs(y1 - y0)}px`;
  if (!done) return;
  const x = (v) => (2 * (v - box.left)) / box.width - 1, y = (v) => 1 - (2 * (v - box.top)) / box.height;
  const rectangle = [Math.min(x(x0), x(x1)), Math.min(y(y0), y(y1)), Math.max(x(x0), x(x1)), Math.max(y(y0), y(y1))];
  ask("region", { ...shown(), matrix: picture.matrix().toArray(), rectangle }).then((found) => inspector.region(found), tell);
};

async function showTrails() {
  if (!state.trails || state.after) return picture.showTrails(null);
  try {
    picture.showTrails(await ask("trails", { ...shown(), frames: state.trails }));
  } catch {
    picture.showTrails(null);
  }
}

// ---- out ----

function openOut(on) {
  out.open(on);
  press(by("save"), on);
}

// A line of seven numbers, to copy to the command line or to edit.
function openCamera() {
  const dialog = by("camera-dialog"), field = element("input", { type: "text", id: "camera-text", value: picture.cameraText(), "aria-label": "the camera", size: 64,
    title: "position, target, metres; vertical angle, degrees" });
  const numbers = () => field.value.replace(/^\s*--camera[= ]/, "").split(",").map(Number);
  const say = element("span", { class: "quiet" });
  const use = () => {
    const all = numbers();
    if (![6, 7].includes(all.length) || all.some((x) => !Number.isFinite(x))) { say.textContent = "six or seven numbers, separated by commas"; return; }
    picture.setCamera(all);
    dialog.close();
  };
  field.addEventListener("keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); use(); } });
  dialog.replaceChildren(element("h2", {}, "Camera"), field, element("p", { class: "quiet" }, "Position x,y,z, target x,y,z and the vertical angle, in the form of the option --camera."),
    element("div", { class: "fields" }, element("button", { id: "camera-use", title: "look from there (Enter)", onclick: use }, "look from there"),
      element("button", { id: "camera-scene", title: "look through the scene's camera (0)", disabled: !picture.sceneCamera, onclick: () => { picture.followScene(); dialog.close(); } }, "the scene's"),
      element("button", { id: "camera-copy", title: "for rapid run", onclick: () => { copy(`--camera=${field.value}`, "paste it after rapid run SCENE in a terminal"); dialog.close(); } }, "copy --camera"),
      element("button", { title: "close (Esc)", onclick: () => dialog.close() }, "close"), say));
  dialog.showModal();
  field.select();
}

// ---- reports about the scene ----

function showLegend(message) {
  const legend = by("legend");
  legend.hidden = !message.ranges?.value;
  if (legend.hidden) return;
  const bar_ = element("canvas", { width: 128, height: 1 }), context = bar_.getContext("2d");
  for (let x = 0; x < 128; ++x) { context.fillStyle = `rgb(${ramp(x / 127)})`; context.fillRect(x, 0, 1, 1); }
  const [low, high] = message.ranges.value;
  legend.replaceChildren(bar_, element("div", {}, element("span", {}, brief(low)), element("span", {}, message.colour), element("span", {}, brief(high))),
    message.unknown?.value > 0 ? element("div", {}, `${brief(message.shown - message.unknown.value)} of ${brief(message.shown)} points have a value`) : "");
}

const words = { starting: "starting", computing: "computing", done: "done", full: "memory is full", failed: "error" };

function showChoices(status) {
  const kept = Object.entries(status.names).filter(([, bytes_]) => bytes_ >= 0).map(([name]) => name);
  const fill = (select, list, value) => {
    const text = JSON.stringify(list);
    if (select.dataset.list !== text) { select.replaceChildren(...choices(list)); select.dataset.list = text; }
    select.value = value;
    return select.value === value;
  };
  const attributes = kept.filter((name) => !name.startsWith("group:") && name !== "dt").map((name) => [name, name]);
  const groups = kept.filter((name) => name.startsWith("group:"));
  if (!fill(bar.colour, [["", kept.includes("Cd") ? "Cd" : "speed"], ["speed", "speed"], ...attributes, ...groups.map((name) => [name, name.replace(":", " ")])], state.colour)) { state.colour = ""; bar.colour.value = ""; }
  if (!fill(bar.group, [["", "all"], ...groups.map((name) => [name.slice(6), name.slice(6)])], state.group)) { state.group = ""; bar.group.value = ""; }
  if (!state.output || !status.outputs.includes(state.output)) state.output = status.outputs.includes("main") ? "main" : status.outputs[0] ?? "";
  fill(bar.output, status.outputs.map((name) => [name, name]), state.output);
  bar.output.hidden = status.outputs.length < 2;
  bar.group.hidden = bar.group.previousElementSibling.hidden = groups.length === 0;
}

// where: position in the scene, or the browser's own words; then: the remedy.
function showProblem(what, where, then) {
  by("error").hidden = false;
  by("error").replaceChildren(element("b", {}, what), element("div", { class: "where" }, where), element("div", { class: "quiet" }, then));
}

function showError(error) {
  by("error").hidden = !error;
  if (error)
    showProblem(error.message, `${error.file ? `${error.file}:${error.line}` : ""}${error.node ? `  node ${error.node}` : ""}`,
      "The last good frames stay visible. Save the scene or change a parameter to run it again.");
}

let figuresDue = 0;
function drawFigures() {
  figuresDue ||= setTimeout(() => {
    figuresDue = 0;
    figures.show(state.statistics, state.status.first, state.status.last, state.frame);
  }, state.statistics.length > 1000 ? 250 : 16);
}

// One request at a time, for some hundred frames each.
let askingFigures = false;
async function showFigures(status) {
  if (status.sequence || askingFigures) return;
  askingFigures = true;
  try {
    for (let more = true; more;) {
      // The figures of the previous run stay until new ones arrive.
      const known = state.statisticsRun === state.status.run ? state.statistics : [];
      const answer = await ask("figures", known.length ? { after: known[known.length - 1].frame } : {});
      figures.declare(answer.charts);
      if (answer.run !== state.status.run || !answer.figures.length) break;
      if (answer.run !== state.statisticsRun) { state.statistics = []; state.statisticsRun = answer.run; }
      state.statistics.push(...answer.figures);
      more = answer.more;
    }
  } finally {
    askingFigures = false;
  }
  figures.know(state.statistics);
  drawFigures();
  tellFrame();
}

async function follow() {
  let version = 0, graphNumber = 0;
  for (;;) {
    try {
      const status = await ask("status", { since: version, graph: graphNumber });
      version = status.version;
      const hasGraph = status.graph_number !== graphNumber;
      graphNumber = status.graph_number;
      await take(status, hasGraph).catch(tell); // an error here must not stop the rest
      await new Promise((resolve) => setTimeout(resolve, 30));
    } catch {
      version = graphNumber = 0; // the server may be a new one
      await new Promise((resolve) => setTimeout(resolve, 500));
    }
  }
}

async function take(status, hasGraph) {
  const run = state.status?.run;
  state.status = status;
  document.title = `${status.title} – rapid view`;
  bar.title.textContent = status.title;
  bar.title.title = status.title;
  bar.state.dataset.state = status.state;
  bar.state.title = `frames take ${bytes(status.bytes)} of ${bytes(status.most_bytes)}`;
  bar.state.textContent = status.state === "computing" ? `computing ${newest() || status.first} of ${status.last}` : words[status.state];
  showChoices(status);
  showError(status.error);
  if (status.sequence && !parameterPart.hidden) {
    // Files have no parameters, no graph and no statistics.
    parameterPart.hidden = tabs.graph.button.hidden = tabs.figures.button.hidden = true;
    openTab("sheet");
  }
  parameters.show(status);
  out.show(status);
  inspector.messages(status);
  timeline.show(status);
  if (hasGraph) {
    graph.show(status.graph, status.no_graph);
    if (state.after && !graph.node(state.after)) chooseNode("");
  }
  showFigures(status).catch(() => {});
  // Shows the newest frame until one is chosen; then the chosen one, as soon as this run has it.
  const end = newest(), isDue = state.shownRun !== status.run || state.shownFrame !== state.frame;
  if (Number.isNaN(state.frame)) { if (!Number.isNaN(end)) await show(status.sequence ? status.first : end, true); }
  else if (state.follow && !Number.isNaN(end) && end !== state.frame && !status.sequence) await show(end);
  else if (run !== status.run || (isDue && isReady(state.frame))) await show(state.frame, true);
  if (status.state === "done" && state.follow && !status.sequence) refreshDetails();
}

bindKeys({
  play, step: (n) => go(state.frame + n), first: () => go(state.status.first), last: () => go(newest()),
  fit: () => picture.fit(), sceneCamera: () => (picture.sceneCamera ? picture.followScene() : flash("the scene has no camera")), centre: () => picture.centre(), alone: () => panels.toggle(), look: (turn, tilt) => picture.look(turn, tilt), openTab,
  press: (id) => by(id).click(), save: () => out.picture(), find: () => { if (!by("graph-tab").hidden) { openTab("graph"); graph.search.focus(); } }, next: (id) => { const s = by(id); s.selectedIndex = (s.selectedIndex + 1) % s.options.length; s.dispatchEvent(new Event("change")); },
  trace: () => { if (state.point !== null) trace(state.point); },
  escape: () => { if (state.after) graph.toggle(graph.chosen); choosePoint(null); inspector.hide("region"); },
});
let saved = null;
try { saved = localStorage.getItem("theme"); } catch { /* none */ }
theme(saved ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));
openTab("graph");
window.rapidView = { state, picture, go, ask, choosePoint, connection, out, graph }; // for the browser's console, and tests
follow();
