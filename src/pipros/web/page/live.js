// The one connection to the server. It comes back by itself, and asks again for what the page looks at.

const RETRY_MS = 1000;

class Live extends EventTarget {
  constructor() {
    super();
    this.next = 1;
    this.requests = new Map(); // id to {message, onData, onError, isAction}
    this.isOpen = false;
    this.connect();
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/live`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.setOpen(true);
      for (const request of this.requests.values()) this.send(request.message);
    };
    this.socket.onclose = () => {
      this.setOpen(false);
      for (const [id, request] of this.requests) {
        if (request.isAction) {
          this.requests.delete(id);
          request.onError("the connection to the server is lost");
        }
      }
      setTimeout(() => this.connect(), RETRY_MS);
    };
    this.socket.onmessage = (event) => this.receive(event.data);
  }

  setOpen(isOpen) {
    this.isOpen = isOpen;
    this.dispatchEvent(new Event("state"));
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  receive(data) {
    if (data instanceof ArrayBuffer) {
      this.requests.get(new DataView(data).getUint32(0))?.onData(new DataView(data, 4));
      return;
    }
    const message = JSON.parse(data);
    const request = this.requests.get(message.id);
    if (!request) return;
    if (request.isAction) this.requests.delete(message.id);
    if ("error" in message) request.onError(message.error);
    else request.onData(message.data);
  }

  // Looks at a view until the function that this returns is called.
  watch(view, args, onData, onError = console.warn) {
    const id = this.next++;
    const message = { id, view, args };
    this.requests.set(id, { message, onData, onError });
    this.send(message);
    return () => {
      if (this.requests.delete(id)) this.send({ id, stop: true });
    };
  }

  // Has the server do something; a promise of its answer.
  act(action, args = {}) {
    return new Promise((resolve, reject) => {
      const id = this.next++;
      const message = { id, action, args };
      this.requests.set(id, { message, isAction: true, onData: resolve, onError: (text) => reject(new Error(text)) });
      this.send(message);
    });
  }
}

export const live = new Live();
