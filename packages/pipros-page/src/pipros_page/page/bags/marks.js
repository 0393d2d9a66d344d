// The marks of a bag's timeline: errors of the log, diagnostics that got worse, and the user's notes, in
// chronological order.

const NEAR_S = 0.0005; // moments are rounded when they are sent
export const KINDS = {
  log: ["▼", "Error in the log"], warning: ["◆", "Warning"], error: ["◆", "Error"], stale: ["◆", "Stale"], note: ["✎", "Note"],
};

export class Marks {
  constructor() {
    this.clear();
  }

  clear() {
    this.found = []; // [time, kind, text]
    this.notes = []; // {time, text}
    this.lost = 0; // marks that the server left out
    this.all = []; // {time, kind, text}
  }

  add(marks, lost) {
    this.found.push(...marks);
    this.lost = lost;
    this.sort();
  }

  setNotes(notes) {
    this.notes = notes;
    this.sort();
  }

  sort() {
    const marks = [...this.found, ...this.notes.map(({ time, text }) => [time, "note", text])];
    this.all = marks.map(([time, kind, text]) => ({ time, kind, text })).sort((one, other) => one.time - other.time);
  }

  // Returns the first mark after a moment or, with a negative `direction`, the last one before it; undefined if there is none.
  next(moment, direction) {
    if (direction > 0) return this.all.find(({ time }) => time > moment + NEAR_S);
    return this.all.filter(({ time }) => time < moment - NEAR_S).at(-1);
  }

  // Returns the marks at a moment.
  at(moment) {
    return this.all.filter(({ time }) => Math.abs(time - moment) <= NEAR_S);
  }
}
