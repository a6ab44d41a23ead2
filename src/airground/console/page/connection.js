/** The line to the server: one WebSocket, kept up; its clock; and an answer for every question, also when the line breaks. */

export const VERSION = 1;
const BACKOFF_S = [0.2, 0.4, 0.8, 1.6, 3];
const SILENT_S = 3; // states come 15 times a second: silence means that the line is dead, whatever TCP believes
const ANSWER_S = 3;
const WATCH_MS = 500;

/** The session's clock as seen from here: the ping that came back quickest tells best. */
export class SessionClock {
  #samples = [];
  roundTrip = null;

  pong(sent, received, t) {
    this.roundTrip = received - sent;
    this.#samples.push({ roundTrip: received - sent, offset: t - (sent + received) / 2 });
    if (this.#samples.length > 20) this.#samples.shift();
  }

  /** @returns {number|null} seconds since the session began */
  now() {
    if (!this.#samples.length) return null;
    const best = this.#samples.reduce((a, b) => (b.roundTrip < a.roundTrip ? b : a));
    return performance.now() / 1000 + best.offset;
  }

  forget() {
    this.#samples = [];
    this.roundTrip = null;
  }
}

export class Connection {
  #socket = null;
  #seq = 0;
  #asked = new Map();
  #pings = new Map();
  #tries = 0;
  #heard = 0;
  #timer = 0;
  #watched = 0;
  clock = new SessionClock();
  /** @type {"connecting"|"live"|"lost"|"refused"} */
  state = "connecting";

  /** @param {{token: () => string|null, name: string, onState: Function, onData: Function, onImage: Function, onRefusal: Function, onClosed: Function}} options */
  constructor(options) {
    this.options = options;
    setInterval(() => this.#watch(), WATCH_MS);
  }

  /** Connect now, also while waiting for the next try. */
  open() {
    clearTimeout(this.#timer);
    this.#socket?.close();
    const { protocol, host } = location;
    const socket = new WebSocket(`${protocol === "https:" ? "wss" : "ws"}://${host}/ws`);
    socket.binaryType = "arraybuffer";
    this.#socket = socket;
    this.#heard = performance.now();
    socket.onopen = () => {
      const token = this.options.token();
      socket.send(JSON.stringify({ kind: "hello", version: VERSION, name: this.options.name, ...(token ? { token } : {}) }));
    };
    socket.onmessage = (event) => socket === this.#socket && this.#receive(event.data);
    socket.onclose = (event) => socket === this.#socket && this.#lost(event);
  }

  /** Close for good: a page of another version must not speak on. */
  end() {
    clearTimeout(this.#timer);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
    this.#set("refused");
  }

  get ready() {
    return this.state === "live" && this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Send without waiting for an answer. @returns {boolean} whether there was a line */
  send(message) {
    if (!this.ready) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Send and wait for what the server says to it. @returns {Promise<{ok: boolean, line: string}>} */
  ask(message) {
    const seq = ++this.#seq;
    if (!this.send({ ...message, seq })) return Promise.resolve({ ok: false, line: "There is no connection." });
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.#answer(seq, { ok: false, line: "The server did not answer." }), ANSWER_S * 1000);
      this.#asked.set(seq, { resolve, timer });
    });
  }

  /** Send what is repeated many times a second: nobody waits for the answer, but a refusal is told. @returns {boolean} */
  stream(message) {
    return this.send({ ...message, seq: ++this.#seq });
  }

  #answer(seq, reply) {
    const asked = this.#asked.get(seq);
    if (!asked) {
      if (!reply.ok) this.options.onRefusal(reply.line);
      return;
    }
    clearTimeout(asked.timer);
    this.#asked.delete(seq);
    asked.resolve(reply);
  }

  #receive(data) {
    this.#heard = performance.now();
    if (data instanceof ArrayBuffer) return this.#image(data);
    const message = JSON.parse(data);
    if (message.reply !== undefined) return this.#answer(message.reply, { ok: message.ok, line: message.line ?? "" });
    if (message.pong !== undefined) {
      const sent = this.#pings.get(message.pong);
      this.#pings.delete(message.pong);
      if (sent !== undefined) this.clock.pong(sent, performance.now() / 1000, message.t);
      return undefined;
    }
    if (message.key === "hello") {
      this.#tries = 0;
      this.#set("live");
      this.#ping();
    }
    return this.options.onData(message.key, message.data);
  }

  /** Four bytes with the length of a JSON header, the header, a JPEG. The next one comes when this one is acknowledged. */
  async #image(buffer) {
    const length = new DataView(buffer).getUint32(0);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    try {
      const bitmap = await createImageBitmap(new Blob([new Uint8Array(buffer, 4 + length)], { type: "image/jpeg" }));
      this.options.onImage(header, bitmap);
    } catch (error) {
      console.warn("an image could not be decoded", error);
    } finally {
      this.send({ kind: "shown", index: header.index });
    }
  }

  #ping() {
    const id = ++this.#seq;
    if (this.#pings.size > 20) this.#pings.clear();
    this.#pings.set(id, performance.now() / 1000);
    this.send({ kind: "ping", id });
  }

  #watch() {
    // A page that was not given the processor has not heard what is waiting for it: that is no silence of the line.
    const now = performance.now();
    if (now - this.#watched > WATCH_MS * 2) this.#heard = now;
    this.#watched = now;
    if (this.state === "live") this.#ping();
    if (this.#socket && performance.now() - this.#heard > SILENT_S * 1000) {
      const socket = this.#socket;
      this.#lost({ code: 1006, reason: "silent" });
      socket.close();
    }
  }

  #lost({ code, reason }) {
    this.#socket = null;
    this.clock.forget();
    this.#pings.clear();
    for (const seq of [...this.#asked.keys()]) this.#answer(seq, { ok: false, line: "The connection was lost." });
    // Whoever is not let in does not knock again by itself.
    if (this.options.onClosed(code, reason)) return this.#set("refused");
    this.#set("lost");
    const wait = BACKOFF_S[Math.min(this.#tries++, BACKOFF_S.length - 1)];
    this.#timer = setTimeout(() => this.open(), wait * 1000);
    return undefined;
  }

  #set(state) {
    if (this.state === state) return;
    this.state = state;
    this.options.onState(state);
  }
}
