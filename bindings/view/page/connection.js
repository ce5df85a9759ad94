// The way to the server: requests, answered in any order.

const kinds = { u8: Uint8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, f32: Float32Array };

// A binary answer: its header, and the arrays that it names (without copies).
function decode(buffer) {
  const head = new Uint32Array(buffer, 0, 2);
  if (head[1] === 0) return { re: head[0], data: new Uint8Array(buffer, 8) };
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, head[1])));
  const begin = 8 + head[1], arrays = {};
  for (const [name, array] of Object.entries(header.arrays))
    arrays[name] = new kinds[array.type](buffer, begin + array.begin, array.count);
  return { re: head[0], ...header, arrays, bytes: buffer.byteLength };
}

export class Connection {
  // lost: called when the server is gone, and found when it is there.
  constructor({ lost, found }) {
    this.waiting = new Map();
    this.next = 1;
    this.lost = lost;
    this.found = found;
    this.open();
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    let refuse;
    this.ready = new Promise((resolve, reject) => {
      this.socket.onopen = () => { resolve(); this.found(); };
      refuse = reject;
    });
    this.ready.catch(() => {}); // those that wait are told
    this.socket.onmessage = (event) => {
      const answer = typeof event.data === "string" ? JSON.parse(event.data) : decode(event.data);
      const waiting = this.waiting.get(answer.re);
      this.waiting.delete(answer.re);
      if (!waiting) return;
      if (typeof answer.error === "string") waiting.reject(new Error(answer.error));
      else waiting.resolve(answer);
    };
    this.socket.onclose = () => {
      refuse(new Error("the server has gone"));
      for (const { reject } of this.waiting.values()) reject(new Error("the server has gone"));
      this.waiting.clear();
      this.lost();
      setTimeout(() => this.open(), 1000);
    };
  }

  async ask(what, given = {}) {
    await this.ready;
    if (this.socket.readyState !== WebSocket.OPEN) throw new Error("the server has gone");
    const re = this.next++;
    return new Promise((resolve, reject) => {
      this.waiting.set(re, { resolve, reject });
      this.socket.send(JSON.stringify({ re, do: what, ...given }));
    });
  }
}
