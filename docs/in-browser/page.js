// Makes each Python block of the page editable and runnable, and keeps files that are dropped on the page.

const OUTPUT_LIMIT = 100_000;
const blocks = [];
let worker = null;
let busy = null;

function element(name, properties, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

function show(block, text) {
  if (block.output.textContent.length < OUTPUT_LIMIT) block.output.append(text.slice(0, OUTPUT_LIMIT));
}

function end() {
  busy = null;
  for (const block of blocks) {
    block.button.textContent = "Run";
    block.button.disabled = false;
  }
}

function receive({ data }) {
  if (busy && data.output) show(busy, data.output);
  if (data.failed) {
    if (busy) show(busy, `Python cannot be started: ${data.failed}\n`);
    stop();
  }
  if (data.done) end();
}

function stop() {
  worker?.terminate();
  worker = null;
  end();
}

function post(request, transfer = []) {
  if (!worker) {
    worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
    worker.onmessage = receive;
    worker.onerror = (event) => receive({ data: { failed: event.message || "its files are missing" } });
  }
  worker.postMessage(request, transfer);
}

function begin(block) {
  busy = block;
  block.output.textContent = worker ? "" : "loading Python …\n";
  for (const other of blocks) other.button.disabled = other !== block;
  block.button.textContent = "Stop";
}

function run(block) {
  begin(block);
  post({ run: block.editor.value });
}

function makeRunnable(code) {
  const text = code.textContent.trimEnd();
  const editor = element("textarea", { value: text, rows: text.split("\n").length, spellcheck: false, ariaLabel: "Python" });
  const button = element("button", { textContent: "Run", type: "button", className: "md-button" });
  const output = element("pre", { ariaLive: "polite" });
  const block = { editor, button, output };
  button.onclick = () => (busy === block ? stop() : run(block));
  (code.closest(".highlight") ?? code.parentElement).replaceWith(element("div", { className: "in-browser" }, editor, button, output));
  blocks.push(block);
}

async function keep(files) {
  for (const file of files) {
    const content = await file.arrayBuffer();
    post({ save: file.name.replaceAll("/", "_"), content }, [content]);
  }
  if (!busy) run(blocks.at(-1));
}

for (const code of document.querySelectorAll(".highlight code")) makeRunnable(code);
const chooser = /** @type {HTMLInputElement} */ (document.getElementById("bag-file"));
chooser?.addEventListener("change", () => keep(chooser.files));
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  if (event.dataTransfer.files.length) keep(event.dataTransfer.files);
});
