// The picture drawn by the renderer of pictures, above the page's own. It appears when nothing has changed for a
// moment.

const pause = 150; // ms

export class Rendered {
  // wish(): the view to draw, or null; ask(wish): the answer with the .png; tell(error).
  constructor(image, { wish, ask, tell }) {
    Object.assign(this, { image, wish, ask, tell });
    this.changes = 0;
  }

  change() {
    ++this.changes;
    this.image.hidden = true;
    clearTimeout(this.due);
    if (this.wish()) this.due = setTimeout(() => this.draw(), pause);
  }

  // One request at a time.
  async draw() {
    const wish = this.wish(), changes = this.changes;
    if (this.isAsking || !wish) return;
    this.isAsking = true;
    try {
      const { data } = await this.ask(wish);
      if (changes === this.changes) await this.put(data, wish.frame);
    } catch (error) {
      this.tell(error);
    }
    this.isAsking = false;
    if (changes !== this.changes) this.draw();
  }

  async put(data, frame) {
    const before = this.image.src, changes = this.changes;
    this.image.src = URL.createObjectURL(new Blob([data], { type: "image/png" }));
    await this.image.decode();
    if (before.startsWith("blob:")) URL.revokeObjectURL(before);
    if (changes !== this.changes) return;
    this.image.dataset.frame = frame;
    this.image.hidden = false;
  }
}
