// Whether the server is silent although the connection is open: it is suspended, or the link to it is interrupted. TCP does
// not report this. The server sends at least one message a second (BEAT_S in view_server.py), and large ones in parts, so that this
// holds for links of 15 kB/s or more.

export const TICK_MS = 250; // interval of `tick`
const SILENT_MS = 2500; // with the tick, the page shows it within 3 s
const RENEW_MS = 20000; // a new connection can work again long before TCP repeats what it has lost
const LATE_MS = 1500; // after a longer pause between ticks, the page itself was suspended, and messages may await handling

export class Silence {
  constructor() {
    this.seconds = 0; // how long the server has been silent; 0 if it is not
    this.heard = null; // time (ms) of the last message; null if the connection is known to be closed
    this.began = null; // time (ms) when the present connection was begun
    this.ticked = 0;
  }

  begin(now) {
    this.began = now;
  }

  hear(now) {
    this.heard = now;
  }

  // The connection was closed: there is nothing to wait for.
  end() {
    this.heard = this.began = null;
  }

  // Updates `seconds`. Returns whether a new connection should replace the present one.
  tick(now) {
    const isLate = now - this.ticked > LATE_MS;
    this.ticked = now;
    const silent = this.heard === null ? 0 : now - this.heard;
    if (silent < SILENT_MS) this.seconds = 0;
    else if (!isLate) this.seconds = Math.round(silent / 1000);
    if (isLate || this.began === null || now - Math.max(this.began, this.heard ?? 0) <= RENEW_MS) return false;
    this.began = now;
    return true;
  }
}

export const silence = new Silence();
