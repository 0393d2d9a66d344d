// Decodes the clouds of a display: small ones at once, large ones in a worker.

import { cloudArrays } from "./cloud_arrays.js";
import { columnsOf } from "./cloud_colours.js";

const LARGE = 20000; // points

export class CloudDecoder {
  // `show(arrays, job)` is called with the result of `cloudArrays`, `fail(text)` with an error.
  constructor(show, fail) {
    this.show = show;
    this.fail = fail;
    this.worker = null;
    this.current = null; // the job of the worker
    this.next = null; // the newest job; older ones that wait are dropped
    this.turn = 0;
  }

  // Decodes a cloud as the server sent it. `job` has {head, data, options} and what `show` needs; `data`, the bytes of the
  // columns, cannot be used afterwards.
  decode(job) {
    if (Math.ceil(job.head.count / job.head.step) < LARGE) {
      this.show(cloudArrays(columnsOf(job.head, job.data), job.options), job);
      return;
    }
    if (this.current) this.next = job;
    else this.post(job);
  }

  post(job) {
    this.worker ??= this.started();
    this.current = job;
    this.turn += 1;
    const { head, data, options } = job;
    this.worker.postMessage({ turn: this.turn, head, buffer: data.buffer, offset: data.byteOffset, options }, [data.buffer]);
  }

  started() {
    const worker = new Worker(new URL("./cloud_worker.js", import.meta.url), { type: "module" });
    worker.onmessage = ({ data: { turn, arrays, problem } }) => {
      if (turn !== this.turn) return; // the result of a job before `forget`
      const [done, { next }] = [this.current, this];
      this.current = this.next = null;
      if (next) this.post(next);
      if (problem) this.fail(problem);
      else this.show(arrays, done);
    };
    worker.onerror = (event) => {
      this.end();
      this.fail(`The worker that decodes clouds has failed: ${event.message}`);
    };
    return worker;
  }

  // Drops the clouds that are being decoded.
  forget() {
    this.turn += 1;
    this.current = this.next = null;
  }

  end() {
    this.forget();
    this.worker?.terminate();
    this.worker = null;
  }
}
