// The connection to the server. Reconnects automatically and re-subscribes the open views.

import { PartialMessage, partOf } from "./partial_message.js";
import { accepted, currentProof, refused, takeFromAddress, wasAccepted } from "./secret.js";
import { TICK_MS, silence } from "./silence.js";

const RETRY_MS = 1000;
const POLICY_VIOLATION = 1008; // close code for a missing or wrong token
const LOGIN_ID = 0;

/** The frame that shows the page in a browser tab whose workers run the server: it connects the page to the server's worker. */
const surrounding = /** @type {any} */ (window.frameElement);

class Live extends EventTarget {
  constructor() {
    super();
    this.next = 1;
    this.requests = new Map(); // id to {message, onData, onError, isAction, hasFailed, partial}
    this.isOpen = false;
    this.isRefused = false; // the token is missing or wrong
    this.node = ""; // the name of the server's own node
    this.ofMessages = new Set(); // the views that show messages: of the system, or of a bag
    this.isSmooth = true; // whether scenes are drawn with anti-aliasing
    this.isRestarted = false; // the server rejects a token that it once accepted
    // Called before a request: null, or a promise that is rejected if the request must not be sent. The requests of a node's page change
    // the node, and a silent server would act on them long afterwards.
    /** @type {(name: string) => Promise<any> | null} */
    this.ask = (_name) => (silence.seconds ? Promise.reject(new Error(`not done: ${this.problem()}`)) : null);
    this.trouble = ""; // the server's reason for closing the connection
    this.connect();
    setInterval(() => this.tick(), TICK_MS);
    addEventListener("hashchange", () => {
      if (!takeFromAddress()) return;
      this.socket?.close();
      this.connect();
    });
  }

  connect() {
    clearTimeout(this.retry);
    this.isRefused = currentProof() === null;
    if (this.isOpen) this.setOpen(false); // an address with a token was opened in this tab
    if (this.isRefused) {
      this.setOpen(false);
      return;
    }
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = surrounding?.connect?.() ?? new WebSocket(`${scheme}//${location.host}/live`);
    this.socket = socket;
    silence.begin(performance.now());
    socket.binaryType = "arraybuffer";
    socket.onopen = () => socket.send(JSON.stringify(currentProof()));
    socket.onclose = (event) => {
      if (socket !== this.socket) return;
      silence.end();
      this.lose(event);
    };
    socket.onmessage = (event) => {
      if (socket !== this.socket) return;
      silence.hear(performance.now());
      if (silence.seconds) this.tick();
      this.receive(event.data);
    };
  }

  // Reports the silence of the server, each second, with the event "silence"; after a while, connects again.
  tick() {
    const before = silence.seconds;
    const { socket } = this;
    if (silence.tick(performance.now())) {
      this.socket = null;
      socket.close();
      this.lose({ code: 0, reason: "" });
    }
    if (silence.seconds !== before) this.dispatchEvent(new Event("silence"));
  }

  // Returns why the page shows no current data, empty if it does. `server` is what the user calls the server.
  problem(server = "the server") {
    if (this.isRefused) return "no access";
    if (silence.seconds) return `no answer from the server for ${silence.seconds} s`;
    return this.isOpen ? "" : this.trouble || `no connection to ${server}`;
  }

  get isCurrent() {
    return this.isOpen && !silence.seconds;
  }

  begin(token) {
    accepted(token);
    this.trouble = "";
    this.setOpen(true);
    for (const request of this.requests.values()) {
      request.partial = null;
      this.send(request.message);
    }
  }

  lose(event) {
    this.isRefused = event.code === POLICY_VIOLATION;
    this.trouble = event.reason;
    if (this.isRefused) {
      this.isRestarted = "token" in (currentProof() ?? {}) && wasAccepted();
      refused();
    }
    this.setOpen(false);
    for (const [id, request] of this.requests) {
      if (request.isAction) {
        this.requests.delete(id);
        request.onError("the connection to the server was lost");
      }
    }
    if (!this.isRefused) this.retry = setTimeout(() => this.connect(), RETRY_MS);
  }

  setOpen(isOpen) {
    this.isOpen = isOpen;
    this.dispatchEvent(new Event("state"));
  }

  send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  receive(data) {
    if (data instanceof ArrayBuffer) {
      const number = partOf(data);
      if (number !== null) {
        this.receivePart(number, data);
        return;
      }
      this.answer(new DataView(data).getUint32(0), new DataView(data, 4));
      return;
    }
    const message = JSON.parse(data);
    if (message.id === LOGIN_ID) this.begin(message.data.token);
    else this.answer(message.id, message.data, message.error);
  }

  receivePart(number, data) {
    const request = this.requests.get(number);
    if (!request) return; // it was stopped meanwhile
    request.partial ??= new PartialMessage();
    const whole = request.partial.add(data);
    if (whole !== null) this.receive(whole);
  }

  answer(id, data, error) {
    const request = this.requests.get(id);
    if (!request) return;
    if (request.isAction) this.requests.delete(id);
    if (error !== undefined || request.hasFailed) request.onError(error ?? ""); // without an error, the view has recovered
    request.hasFailed = error !== undefined;
    if (!request.hasFailed) request.onData(data);
  }

  // Subscribes to a view. Returns a function that unsubscribes.
  watch(view, args, onData, onError = (text) => text && console.warn(text)) {
    const request = { message: { id: this.next++, view, args }, onData, onError };
    let isOver = false;
    const begin = () => {
      if (isOver) return;
      this.requests.set(request.message.id, request);
      this.send(request.message);
    };
    const asked = this.ask(view);
    if (asked) asked.then(begin, (problem) => isOver || onError(problem.message));
    else begin();
    return () => {
      isOver = true;
      if (this.requests.delete(request.message.id)) this.send({ id: request.message.id, stop: true });
    };
  }

  // Subscribes again to the views that show messages, because the messages now come from another source.
  restart() {
    const before = [...this.requests];
    this.dispatchEvent(new Event("source"));
    for (const [id, request] of before) {
      if (!this.requests.has(id) || !this.ofMessages.has(request.message.view)) continue;
      this.requests.delete(id);
      this.send({ id, stop: true });
      request.message = { ...request.message, id: this.next++ };
      this.requests.set(request.message.id, request);
      this.send(request.message);
    }
  }

  // Requests an action. Returns a promise of the answer.
  async act(action, args = {}) {
    const asked = this.ask(action);
    if (asked) await asked;
    return new Promise((resolve, reject) => {
      const id = this.next++;
      const message = { id, action, args };
      this.requests.set(id, { message, isAction: true, onData: resolve, onError: (text) => reject(new Error(text)) });
      this.send(message);
    });
  }
}

export const live = new Live();
