// Reads the output of a terminal: text, colours, and marks; see pipros_tab/terminal.py. Knows nothing of the page.

/* eslint-disable no-control-regex -- escape sequences consist of them */
const SEQUENCE = /\x1b\[([\d;?]*)([A-Za-z])|\x1b\]([^\x07\x1b]*)(?:\x07|\x1b\\)|\r\n|\r|\n/g;
const UNFINISHED = /\x1b(?:\[[\d;?]{0,99}|\][^\x07]{0,1000000})?$/; // bounds what is kept of sequences that never end
/* eslint-enable no-control-regex */

/**
 * What is to be shown: text with classes, the end of a line, a return to its start, an empty screen, or a mark.
 * @typedef {{text: string, style: string} | {line: true} | {start: true} | {clear: true} | {mark: string, value: string}} Piece
 */

export class Output {
  #rest = "";
  #style = "";

  /** @param {string} text @returns {Piece[]} */
  read(text) {
    const whole = this.#rest + text;
    this.#rest = UNFINISHED.exec(whole)?.[0] ?? (whole.endsWith("\r") ? "\r" : "");
    const shown = whole.slice(0, whole.length - this.#rest.length);
    /** @type {Piece[]} */
    const pieces = [];
    let at = 0;
    for (const found of shown.matchAll(SEQUENCE)) {
      if (found.index > at) pieces.push({ text: shown.slice(at, found.index), style: this.#style });
      at = found.index + found[0].length;
      const [sequence, numbers, kind, command] = found;
      if (command !== undefined) {
        const mark = /^133;(\w);(.*)$/s.exec(command);
        if (mark) pieces.push({ mark: mark[1], value: mark[2] });
      } else if (kind === "m") this.#style = styled(this.#style, numbers);
      else if (kind === "J") pieces.push({ clear: true });
      else if (sequence.endsWith("\n")) pieces.push({ line: true });
      else if (sequence === "\r") pieces.push({ start: true });
    }
    if (at < shown.length) pieces.push({ text: shown.slice(at), style: this.#style });
    return pieces;
  }
}

function styled(style, numbers) {
  let classes = style.split(" ").filter(Boolean);
  for (const number of numbers.split(";").map(Number)) {
    if (number === 0) classes = [];
    else if (number === 1) classes.push("bold");
    else if (number >= 30 && number <= 39) classes = [...classes.filter((each) => !each.startsWith("c")), `c${number}`];
  }
  return classes.join(" ");
}
