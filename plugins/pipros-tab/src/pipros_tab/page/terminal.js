// One terminal of the page: shows the output of its shell, and sends it what is typed.

import { h } from "./dom.js";
import { Output } from "./screen.mjs";

const LINES = 3000;
const LINE_CHARACTERS = 16384;
const WHOLE = /^(?:[^"'\\]|\\.|"(?:[^"\\]|\\.)*"|'[^']*')*$/s; // no quote is open
const ENDS_WITHIN_MS = 3000;
const KEYS = { ArrowUp: "\x1b[A", ArrowDown: "\x1b[B", ArrowRight: "\x1b[C", ArrowLeft: "\x1b[D", Enter: "\n" };
const history = JSON.parse(localStorage.getItem("pipros-tab-history") ?? "[]");

export class Terminal {
  #output = new Output();
  #isReady = false;
  #sendsKeys = false; // to the program that runs
  /** @type {string[]} */
  #waiting = []; // lines that were typed while a program ran
  #at = history.length;
  #startsAnew = false;
  #length = 0; // of the line that is being written
  #advice = 0; // the timer after Ctrl-C

  /** @param {import("./hub.mjs").Hub} hub @param {string} name @param {(path: string) => void} edit
   * @param {(line: string) => void} open shows the page whose address a line contains, if any
   * @param {(line: string) => void} done is called with each line whose commands have succeeded
   * @param {string} welcome the first lines */
  constructor(hub, name, edit, open, done, welcome) {
    this.done = done;
    this.open = open;
    this.hub = hub;
    this.edit = edit;
    this.prompt = h("span");
    this.input = h("input", { spellcheck: "false", autocomplete: "off", "aria-label": name,
      onkeydown: (event) => this.#send(event) || this.#key(event), onpaste: (event) => this.#paste(event) });
    this.entry = h("div", { class: "entry" }, this.prompt, this.input);
    this.screen = h("div", { class: "screen" }, this.entry);
    this.scroller = h("div", { class: "scroller", onclick: () => getSelection()?.isCollapsed && this.input.focus() }, this.screen);
    const button = (text, title, onclick) => h("button", { type: "button", title, onclick }, text);
    const stop = button("Stop", "End the program at once", () => hub.type(this.process, { stop: true }));
    const close = button("×", "Close the terminal", () => hub.stop(this.process));
    this.element = h("section", { class: "terminal" }, h("div", { class: "head" }, h("b", {}, name), stop, close), this.scroller);
    this.#newLine();
    this.show(`${welcome}\nStarting Python …\r`);
    this.process = hub.start({ argv: ["bash"] }, (text) => this.show(text));
    this.process.ended.then(() => this.element.remove());
  }

  show(text) {
    for (const piece of this.#output.read(text)) {
      if ("text" in piece) this.#write(piece.text, piece.style);
      else if ("line" in piece) this.#endLine();
      else if ("start" in piece) this.#startsAnew = true;
      else if ("clear" in piece) this.#clear();
      else this.#mark(piece.mark, piece.value);
    }
  }

  #write(text, style) {
    if (this.#startsAnew) this.line.replaceChildren();
    this.#length = text.length + (this.#startsAnew ? 0 : this.#length);
    this.#startsAnew = false;
    this.line.append(h("span", { class: style }, text));
    if (this.#length > LINE_CHARACTERS) this.#newLine();
  }

  /** Shows a line that no program has printed. */
  #print(text) {
    this.#write(text, "");
    this.#newLine();
  }

  #endLine() {
    this.open(this.line.textContent);
    this.#newLine();
  }

  #newLine() {
    this.#startsAnew = false;
    this.#length = 0;
    this.line = h("div");
    this.entry.before(this.line);
    while (this.screen.childElementCount > LINES) this.screen.firstElementChild?.remove();
  }

  #clear() {
    this.screen.replaceChildren(this.entry);
    this.#newLine();
  }

  #mark(letter, value) {
    if (letter === "E") this.edit(value);
    if (letter === "C") this.#complete(JSON.parse(value));
    if (letter === "D") this.done(value);
    if (letter === "K" || letter === "P") this.#sendsKeys = letter === "K";
    if (letter !== "P") return;
    clearTimeout(this.#advice);
    if (this.#startsAnew) this.line.replaceChildren();
    this.#startsAnew = false;
    this.#isReady = true;
    this.prompt.textContent = value;
    const next = this.#waiting.shift();
    if (next !== undefined) this.#run(next);
  }

  #run(line) {
    this.#print(`${this.prompt.textContent}${line}`);
    this.#isReady = false;
    this.prompt.textContent = "";
    if (line.trim() && history.at(-1) !== line) {
      history.push(line);
      localStorage.setItem("pipros-tab-history", JSON.stringify(history.slice(-500)));
    }
    this.#at = history.length;
    this.hub.type(this.process, { line });
  }

  #complete({ typed, completed, words }) {
    if (this.input.value !== typed) return; // the user has typed more
    if (completed === typed && words.length > 1) {
      this.#print(`${this.prompt.textContent}${typed}`);
      this.#print(words.join("  "));
    }
    this.input.value = completed;
  }

  /** Passes a key on to a program that has asked for keys. Returns whether it did. */
  #send(event) {
    const keys = this.#sendsKeys && !event.ctrlKey && (KEYS[event.key] ?? (event.key.length === 1 && event.key));
    if (!keys) return false;
    this.hub.press(this.process, keys);
    event.preventDefault();
    return true;
  }

  #key(event) {
    const { key, ctrlKey } = event;
    if (key === "Enter") this.#enter();
    else if (key === "Tab" && this.input.value && this.#isReady) {
      this.hub.type(this.process, { complete: this.input.value });
    } else if (ctrlKey && key === "c" && getSelection()?.isCollapsed !== false) {
      this.#interrupt();
    } else if (ctrlKey && key === "l") this.#clear();
    else if (key === "ArrowUp" || key === "ArrowDown") {
      this.#at = Math.min(Math.max(this.#at + (key === "ArrowUp" ? -1 : 1), 0), history.length);
      this.input.value = history[this.#at] ?? "";
    } else return;
    event.preventDefault();
  }

  /** Enters the commands of a pasted text, as a terminal does; an entry would join its lines. The last line
   * stays in the entry, unless it ends a quote that an earlier line began. */
  #paste(event) {
    const pasted = event.clipboardData.getData("text").replace(/\\\r?\n/g, "");
    if (!pasted.includes("\n")) return;
    event.preventDefault();
    const { value, selectionStart, selectionEnd } = this.input;
    const lines = `${value.slice(0, selectionStart)}${pasted}${value.slice(selectionEnd)}`.split(/\r?\n/);
    const last = lines.pop();
    let command = "";
    for (const line of lines) {
      command += line;
      if (WHOLE.test(command)) this.#enter(command);
      command = WHOLE.test(command) ? "" : `${command}\n`;
    }
    if (command && WHOLE.test(command + last)) this.#enter(command + last);
    else this.input.value = command + last;
  }

  #enter(line = this.input.value) {
    this.input.value = "";
    if (this.#isReady) this.#run(line);
    else this.#waiting.push(line);
    this.scroller.scrollTop = 0; // the end, as its content is laid out from the end
  }

  #interrupt() {
    this.#print(`${this.prompt.textContent}${this.input.value}^C`);
    this.input.value = "";
    this.#waiting = [];
    if (this.#isReady) return;
    this.hub.interrupt(this.process);
    clearTimeout(this.#advice);
    this.#advice = setTimeout(() => this.#print("The program still runs. Stop, above, ends it at once."), ENDS_WITHIN_MS);
  }
}
