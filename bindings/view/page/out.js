// Exports: this frame as a picture, or a range as a film, at any size, with the camera of the view.
import { element, bytes } from "./dom.js";

const sizes = [["1280x720", "1280 × 720"], ["1920x1080", "1920 × 1080"], ["3840x2160", "3840 × 2160"], ["1080x1080", "1080 × 1080"], ["view", "as in the view"]];

export class Out {
  // ask; shown(): the view with its camera; size(): of the picture here, pixels; tell(text); title(): for names.
  constructor(root, { ask, shown, size, tell, title, close }) {
    Object.assign(this, { ask, shown, viewSize: size, tell, title });
    const number = (id, label, given) => element("input", { type: "number", id, "aria-label": label, title: label, ...given });
    this.width = number("out-width", "width, pixels", { min: 16, max: 16384, value: 1920 });
    this.height = number("out-height", "height, pixels", { min: 16, max: 16384, value: 1080 });
    this.preset = element("select", { id: "out-size", title: "usual sizes", onchange: () => this.choose(this.preset.value) },
      ...sizes.map(([value, text]) => element("option", { value }, text)), element("option", { value: "own" }, "own"));
    this.preset.value = "1920x1080";
    for (const field of [this.width, this.height]) field.addEventListener("input", () => { this.preset.value = "own"; });
    this.first = number("out-first", "the film's first frame");
    this.last = number("out-last", "the film's last frame");
    this.kind = element("select", { id: "out-kind", title: "the film's format" }, ...[".mp4", ".webm", ".gif"].map((kind) => element("option", { value: kind }, kind)));
    this.make = element("button", { id: "out-film", title: "renders the frames and saves the film", onclick: () => this.film() }, "make film");
    this.still = element("button", { id: "out-picture", title: "saves this frame as rapid run draws it (P)", onclick: () => this.picture() }, "save .png");
    this.bar = element("progress", { id: "out-progress", max: 1, value: 0, "aria-label": "progress of the film" });
    this.text = element("span", { class: "quiet number", id: "out-text" });
    this.stop = element("button", { id: "out-cancel", class: "small", title: "cancels the film", onclick: () => this.cancel() }, "cancel");
    this.running = element("div", { class: "fields", hidden: true }, this.bar, this.text, this.stop);
    this.why = element("div", { class: "quiet", hidden: true }, "Films are encoded by the program ffmpeg, which --untrusted does not allow.");
    this.films = element("div", { class: "fields" }, element("label", {}, "frames"), this.first, element("span", { class: "quiet" }, "to"), this.last, this.kind, this.make);
    this.root = element("section", { id: "out", hidden: true },
      element("h2", {}, "Export", element("span", { class: "gap" }), element("button", { title: "close (O)", onclick: close }, "×")),
      element("div", { class: "fields" }, element("label", {}, "size"), this.width, element("span", { class: "quiet" }, "×"), this.height, this.preset, this.still),
      this.films, this.why, this.running);
    root.append(this.root);
  }

  open(on) {
    this.root.hidden = !on;
    if (on) this.root.scrollIntoView({ block: "nearest" });
  }

  show(status) {
    if (this.range !== `${status.first} ${status.last}`) {
      this.range = `${status.first} ${status.last}`;
      this.first.value = status.first;
      this.last.value = status.last;
    }
    this.films.hidden = !status.films;
    this.why.hidden = status.films !== false;
  }

  choose(value) {
    if (value === "own") return;
    // Films have even edge lengths.
    const [width, height] = value === "view" ? this.viewSize().map((x) => 2 * Math.round(x / 2)) : value.split("x");
    this.width.value = width;
    this.height.value = height;
  }

  wish() { return { ...this.shown(), width: Number(this.width.value), height: Number(this.height.value) }; }

  save(data, name, type) {
    const link = element("a", { href: URL.createObjectURL(new Blob([data], { type })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    this.tell(`${name}, ${this.width.value} × ${this.height.value}, ${bytes(data.byteLength)}`);
  }

  async picture() {
    try {
      const wish = this.wish(), { data } = await this.ask("picture", wish);
      this.save(data, `${this.title()}.${String(wish.frame).padStart(4, "0")}.png`, "image/png");
    } catch (error) {
      this.tell(error.message);
    }
  }

  async film() {
    if (this.going) return;
    this.going = true;
    this.make.disabled = true;
    this.running.hidden = false;
    const extension = this.kind.value;
    try {
      let progress = await this.ask("film", { ...this.wish(), extension, first: Number(this.first.value), last: Number(this.last.value) });
      for (;;) {
        this.bar.max = progress.of;
        this.bar.value = progress.done;
        this.text.textContent = `${progress.done} of ${progress.of}`;
        if (progress.ended) break;
        await new Promise((resolve) => setTimeout(resolve, 150));
        if (!this.going) throw new Error("the film is cancelled");
        progress = await this.ask("film_progress");
      }
      const { data } = await this.ask("film_data");
      this.save(data, `${this.title()}${extension}`, { ".mp4": "video/mp4", ".webm": "video/webm", ".gif": "image/gif" }[extension]);
    } catch (error) {
      this.tell(error.message);
    }
    this.going = false;
    this.make.disabled = false;
    this.running.hidden = true;
  }

  cancel() {
    this.going = false;
    this.ask("film_cancel").catch(() => {});
  }
}
