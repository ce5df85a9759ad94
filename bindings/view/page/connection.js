// The connection to the server. Requests are answered in any order.
//
// The token of the address is stored for this tab, where pages of other ports cannot read it. Only the socket's
// subprotocols carry it: a cookie would go to every server of this machine.

const kinds = { u8: Uint8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, f32: Float32Array };

// Decodes a binary answer: its header, and the arrays that it names (without copies).
function decode(buffer) {
  const head = new Uint32Array(buffer, 0, 2);
  if (head[1] === 0) return { re: head[0], data: new Uint8Array(buffer, 8) };
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, head[1])));
  const begin = 8 + head[1], arrays = {};
  for (const [name, array] of Object.entries(header.arrays))
    arrays[name] = new kinds[array.type](buffer, begin + array.begin, array.count);
  return { re: head[0], ...header, arrays, bytes: buffer.byteLength };
}

function rememberToken(token) {
  try { sessionStorage.setItem("token", token); } catch { /* a browser that keeps nothing */ }
  return token;
}

function findToken() {
  const given = new URLSearchParams(location.search).get("token");
  if (given && /^[0-9a-f]+$/.test(given)) return rememberToken(given);
  try { return sessionStorage.getItem("token") ?? ""; } catch { return ""; }
}

export class Connection {
  // lost: called when the server is gone; found: called when it is back.
  constructor({ lost, found }) {
    this.token = findToken();
    this.waiting = new Map();
    this.next = 1;
    this.lost = lost;
    this.found = found;
    this.open();
  }

  protocols() { return ["rapid", `rapid.token.${this.token}`]; }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/socket`, this.protocols());
    this.socket.binaryType = "arraybuffer";
    let refuse;
    this.ready = new Promise((resolve, reject) => {
      this.socket.onopen = () => { resolve(); this.found(); };
      refuse = reject;
    });
    this.ready.catch(() => {}); // the waiting requests receive the error
    this.socket.onmessage = (event) => {
      const answer = typeof event.data === "string" ? JSON.parse(event.data) : decode(event.data);
      if (answer.token) this.token = rememberToken(answer.token); // that of the address works only once
      const waiting = this.waiting.get(answer.re);
      this.waiting.delete(answer.re);
      if (!waiting) return;
      if (typeof answer.error === "string") waiting.reject(new Error(answer.error));
      else waiting.resolve(answer);
    };
    this.socket.onclose = () => {
      refuse(new Error("the server does not answer"));
      for (const { reject } of this.waiting.values()) reject(new Error("the server does not answer"));
      this.waiting.clear();
      this.lost();
      setTimeout(() => this.open(), 1000);
    };
  }

  async ask(what, given = {}) {
    await this.ready;
    if (this.socket.readyState !== WebSocket.OPEN) throw new Error("the server does not answer");
    const re = this.next++;
    return new Promise((resolve, reject) => {
      this.waiting.set(re, { resolve, reject });
      this.socket.send(JSON.stringify({ re, do: what, ...given }));
    });
  }
}
