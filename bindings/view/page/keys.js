// The keys, and the list of them under "?".
import { element, by } from "./dom.js";

const turnFront = [0, 0], turnRight = [Math.PI / 2, 0], turnTop = [0, 1.55];

export function bindKeys(does) {
  const keys = [
    ["Space", "play, pause", [" "], does.play],
    ["← →", "one frame back, forward", ["ArrowLeft"], () => does.step(-1)],
    [null, "", ["ArrowRight"], () => does.step(1)],
    ["Shift ← →", "ten frames back, forward", ["Shift+ArrowLeft"], () => does.step(-10)],
    [null, "", ["Shift+ArrowRight"], () => does.step(10)],
    ["Home End", "first frame, newest frame", ["Home"], does.first],
    [null, "", ["End"], does.last],
    ["F", "show everything", ["f"], does.fit],
    [".", "show the chosen point", ["."], does.centre],
    ["M", "the picture alone, or with all panels", ["m"], does.alone],
    ["1 3 7", "look from the front, the right, above", ["1"], () => does.look(...turnFront)],
    [null, "", ["3"], () => does.look(...turnRight)],
    [null, "", ["7"], () => does.look(...turnTop)],
    ["0", "look through the scene's camera", ["0"], does.sceneCamera],
    ["C", "colour by the next attribute", ["c"], () => does.next("colour")],
    ["D", "draw points as spheres, dots, streaks, or as in pictures", ["d"], () => does.next("style")],
    ["S", "show colliders and emitters", ["s"], () => does.press("shapes")],
    ["G", "show grid and axes", ["g"], () => does.press("ground")],
    ["T", "longer trails", ["t"], () => does.next("trails")],
    ["B", "show the life of the chosen point", ["b"], does.trace],
    ["K", "copy or set the camera", ["k"], () => does.press("camera")],
    ["P", "save this frame as .png", ["p"], does.save],
    ["O", "export pictures and films", ["o"], () => does.press("save")],
    ["/", "find a node", ["/"], does.find],
    ["L", "dark or light", ["l"], () => does.press("theme")],
    ["Alt G, F, S", "open graph, figures, spreadsheet", ["Alt+g"], () => !by("graph-tab").hidden && does.openTab("graph")],
    [null, "", ["Alt+f"], () => !by("figures-tab").hidden && does.openTab("figures")],
    [null, "", ["Alt+s"], () => does.openTab("sheet")],
    ["↑ ↓", "in the spreadsheet: the point above, below", []],
    ["Esc", "clear the selection", ["Escape"], does.escape],
    ["?", "this list", ["?"], () => showKeys()],
  ];
  const actions = new Map(keys.flatMap(([, , names, action]) => names.map((name) => [name, action])));
  window.addEventListener("keydown", (event) => {
    if (document.querySelector("dialog[open]") || event.ctrlKey || event.metaKey) return;
    const typing = event.target.matches?.("input:not([type=range]):not([type=checkbox]), select");
    if (typing && event.key !== "Escape") return;
    if (event.target.matches?.("input[type=range], [role=separator]") && event.key.startsWith("Arrow")) return;
    if (event.target.matches?.("button, [role=button]") && event.key === " ") event.preventDefault();
    const name = event.key.length === 1 && event.key !== "?" ? event.key.toLowerCase() : event.key;
    const full = `${event.altKey ? "Alt+" : ""}${event.shiftKey && name.length > 1 ? "Shift+" : ""}${name}`;
    const action = actions.get(full);
    if (!action) return;
    event.preventDefault();
    action();
  });
  const mouse = [["drag", "orbit"], ["middle, Ctrl drag", "pan"], ["wheel, right drag", "zoom"], ["click", "choose a point"],
    ["Shift drag", "count the points in a region, with their ranges"], ["Ctrl wheel", "zoom the graph"]];
  const row = ([name, what]) => element("tr", {}, element("td", {}, element("kbd", {}, name)), element("td", {}, what));
  by("keys").append(element("h2", {}, "Keys"), element("table", {}, ...keys.filter(([name]) => name).map(row), ...mouse.map(row)),
    element("form", { method: "dialog" }, element("button", {}, "close")));
}

export function showKeys() { by("keys").showModal(); }
