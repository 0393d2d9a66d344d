// One terminal of the page: shows the output of its shell, and sends it what is typed.

import { completed, Output } from "./screen.mjs";

const LINES = 3000;
const LINE_CHARACTERS = 16384;
const WHOLE = /^(?:[^"'\\]|\\.|"(?:[^"\\]|\\.)*"|'[^']*')*$/s; // no quote is open
const history = JSON.parse(localStorage.getItem("pipros-tab-history") ?? "[]");

export class Terminal {
  #output = new Output();
  #isReady = false;
  /** @type {string[]} */
  #waiting = []; // lines that were typed while a program ran
  #at = history.length;
  #startsAnew = false;
  #length = 0; // of the line that is being written
  #isDrawn = true; // false until the next frame
  #height = 0; // of the screen before it is resized

  /** @param {import("./hub.mjs").Hub} hub @param {string} name @param {(path: string) => void} edit
   * @param {(line: string) => boolean} open shows the page whose address a line contains, if any */
  constructor(hub, name, edit, open) {
    this.open = open;
    this.hub = hub;
    this.edit = edit;
    this.screen = make("div", "screen");
    this.prompt = make("span", "");
    this.input = Object.assign(make("input", ""), { spellcheck: false, autocomplete: "off", ariaLabel: name });
    this.entry = make("div", "entry", this.prompt, this.input);
    const stop = button("Stop", "End the program at once", () => hub.type(this.process, { stop: true }));
    const close = button("×", "Close the terminal", () => hub.stop(this.process));
    this.element = make("section", "terminal", make("div", "head", make("b", "", name), stop, close), this.screen);
    this.screen.append(this.entry);
    this.line = this.#newLine();
    this.input.addEventListener("keydown", (event) => this.#key(event));
    this.input.addEventListener("paste", (event) => this.#paste(event));
    this.screen.addEventListener("click", () => getSelection()?.isCollapsed && this.input.focus());
    new ResizeObserver(() => this.#keepEnd()).observe(this.screen);
    this.process = hub.start({ argv: ["bash"] }, (text) => this.show(text));
    this.process.ended.then(() => this.element.remove());
  }

  show(text) {
    if (this.#isDrawn) this.#follow();
    for (const piece of this.#output.read(text)) {
      if ("text" in piece) this.#write(piece.text, piece.style);
      else if ("line" in piece) this.#endLine();
      else if ("start" in piece) this.#startsAnew = true;
      else if ("clear" in piece) this.#clear();
      else this.#mark(piece.mark, piece.value);
    }
  }

  /** Scrolls to the end with the next frame if the end is seen now. To ask it at each piece of output would take most of the time. */
  #follow() {
    const isAtEnd = this.#isAtEnd();
    this.#isDrawn = false;
    requestAnimationFrame(() => {
      this.#isDrawn = true;
      if (isAtEnd) this.screen.scrollTop = this.screen.scrollHeight;
    });
  }

  /** A further terminal makes the others smaller: if the end was seen before, it is seen after. */
  #keepEnd() {
    if (this.#isAtEnd()) this.screen.scrollTop = this.screen.scrollHeight;
    this.#height = this.screen.clientHeight;
  }

  #isAtEnd() {
    const { scrollTop, scrollHeight, clientHeight } = this.screen;
    return scrollTop + Math.max(clientHeight, this.#height) > scrollHeight - 40;
  }

  #write(text, style) {
    if (this.#startsAnew) this.line.replaceChildren();
    this.#length = text.length + (this.#startsAnew ? 0 : this.#length);
    this.#startsAnew = false;
    this.line.append(make("span", style, text));
    if (this.#length > LINE_CHARACTERS) this.line = this.#newLine();
  }

  #endLine() {
    const { line } = this;
    if (this.open(line.textContent ?? "")) {
      line.classList.add("link");
      line.title = "Show the page again";
      line.onclick = () => this.open(line.textContent ?? "");
    }
    this.line = this.#newLine();
  }

  #newLine() {
    this.#startsAnew = false;
    this.#length = 0;
    const line = make("div", "");
    this.entry.before(line);
    while (this.screen.childElementCount > LINES) this.screen.firstElementChild?.remove();
    return line;
  }

  #clear() {
    this.screen.replaceChildren(this.entry);
    this.line = this.#newLine();
  }

  #mark(letter, value) {
    if (letter === "E") this.edit(value);
    if (letter === "C") this.#complete(JSON.parse(value));
    if (letter !== "P") return;
    this.#isReady = true;
    this.prompt.textContent = value;
    const next = this.#waiting.shift();
    if (next !== undefined) this.#run(next);
  }

  #run(line) {
    this.#write(`${this.prompt.textContent}${line}`, "");
    this.line = this.#newLine();
    this.#isReady = false;
    this.prompt.textContent = "";
    if (line.trim() && history.at(-1) !== line) {
      history.push(line);
      localStorage.setItem("pipros-tab-history", JSON.stringify(history.slice(-500)));
    }
    this.#at = history.length;
    this.hub.type(this.process, { line });
  }

  #complete(words) {
    const line = completed(this.input.value, words);
    if (line === this.input.value && words.length > 1) {
      this.#write(`${this.prompt.textContent}${line}`, "");
      this.line = this.#newLine();
      this.#write(words.join("  "), "");
      this.line = this.#newLine();
    }
    this.input.value = line;
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
    this.screen.scrollTop = this.screen.scrollHeight;
  }

  #interrupt() {
    this.#write(`${this.prompt.textContent}${this.input.value}^C`, "");
    this.line = this.#newLine();
    this.input.value = "";
    this.#waiting = [];
    if (!this.#isReady) this.hub.interrupt(this.process);
  }
}

function make(name, className, ...children) {
  const made = document.createElement(name);
  made.className = className;
  made.append(...children);
  return made;
}

function button(text, title, onclick) {
  return Object.assign(make("button", "", text), { type: "button", title, onclick });
}
