// Decides when the next picture may begin, so that the page's thread has time for messages.

const SLOW_MS = 100; // longer pictures are slow: after two of them, time is reserved for the page's thread
const FREE = 0.3; // reserved time, as a part of the duration of the last picture

export class Pacing {
  constructor(gl) {
    this.gl = gl;
    this.unfinished = []; // fences behind the commands of the last pictures
    this.drawnAt = null; // the time of the last animation frame, if a picture was drawn in it
    this.wasSlow = false; // whether the last picture was slow
    this.resumesAt = 0; // when pictures may be drawn again
  }

  // Notes that a picture was drawn in the animation frame of a time.
  drawn(time) {
    this.drawnAt = time;
    this.unfinished.push(this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0));
    this.gl.flush();
  }

  // Called in each animation frame. Without a graphics card, the browser stops the page's thread until a picture is finished. After
  // two slow ones, some time is left for messages: a large one arrives in hundreds of parts, and drawing one picture right after another
  // would let only one part through.
  note(time) {
    if (this.drawnAt === null) return;
    const took = time - this.drawnAt;
    this.drawnAt = null;
    this.resumesAt = took > SLOW_MS && this.wasSlow ? time + FREE * took : 0;
    this.wasSlow = took > SLOW_MS;
  }

  // Returns whether a picture may be drawn: all but the last one must be finished, because commands for one more would wait for them.
  isReady(time) {
    const { gl } = this;
    while (this.unfinished.length && gl.getSyncParameter(this.unfinished[0], gl.SYNC_STATUS) !== gl.UNSIGNALED)
      gl.deleteSync(this.unfinished.shift());
    return time >= this.resumesAt && this.unfinished.length < 2;
  }

  // Forgets the pictures of a lost context.
  forget() {
    this.unfinished = [];
  }
}
