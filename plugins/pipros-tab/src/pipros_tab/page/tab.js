// The page: terminals, the files of the home folder, and an editor.

import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { python } from "@codemirror/lang-python";
import { xml } from "@codemirror/lang-xml";
import { bracketMatching, defaultHighlightStyle, indentOnInput, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { EditorState } from "@codemirror/state";
import { EditorView, drawSelection, highlightActiveLine, keymap, lineNumbers } from "@codemirror/view";
import { Hub } from "./hub.mjs";
import { Pictures } from "./pictures.js";
import { keepFiles } from "./store.js";
import { Terminal } from "./terminal.js";

const HOME = "/home/student";
const PACKED = `${HOME}/.ros/student.zip`; // neither listed nor kept
const OPENED = "/tmp/opened.zip"; // in one worker alone
const TERMINALS = 3;
const IS_FOLDER = 0o040000;
const NOT_LISTED = /\/\.ros(\/|$)|\/(build|devel)\//;
const RELOADED = "pipros-tab-reloaded";
const $ = (id) => /** @type {any} */ (document.getElementById(id));
const say = (text) => ($("state").textContent = text);

function startWorker(data, onMessage) {
  const worker = new Worker(new URL("tab_worker.js", import.meta.url), { type: "module" });
  worker.onmessage = (event) => onMessage(event.data);
  worker.onerror = (event) => onMessage({ output: `${event.message ?? "its files are missing"}\n` });
  worker.postMessage(data);
  return worker;
}

/** Returns whether the page may share memory; if not, says why, or reloads with the headers of the service worker. */
async function isIsolated() {
  if (crossOriginIsolated) {
    sessionStorage.removeItem(RELOADED);
    void navigator.serviceWorker?.register(new URL("headers.js", import.meta.url));
    return true;
  }
  if (!isSecureContext) say("Browsers share memory only on https pages, and on localhost: use one of these addresses.");
  else if (!navigator.serviceWorker || sessionStorage.getItem(RELOADED)) {
    say("This browser does not let pages share memory: try another one.");
  } else {
    sessionStorage.setItem(RELOADED, "yes");
    await navigator.serviceWorker.register(new URL("headers.js", import.meta.url));
    await navigator.serviceWorker.ready;
    location.reload();
  }
  return false;
}

class Editor {
  constructor(hub) {
    this.hub = hub;
    this.view = new EditorView({ parent: $("editor") });
    $("save").onclick = () => this.save();
    addEventListener("pagehide", () => this.save());
    $("close").onclick = () => $("editor").toggleAttribute("hidden", this.save());
  }

  open(path) {
    this.save();
    this.path = path;
    $("editor").hidden = false;
    $("editor-name").textContent = path.replace(`${HOME}/`, "");
    const doc = new TextDecoder().decode(this.hub.files.get(path)?.[1]);
    this.view.setState(EditorState.create({ doc, extensions: this.#extensions(path) }));
    this.saved = this.view.state.doc;
    this.view.focus();
  }

  save() {
    const { doc } = this.view.state;
    if (this.saved && !doc.eq(this.saved)) {
      this.hub.writeFile(this.path, new TextEncoder().encode(doc.toString()));
      say(`saved ${$("editor-name").textContent}`);
    }
    this.saved = doc;
    return true;
  }

  #extensions(path) {
    const language = path.endsWith(".py") ? [python()] : /\.(xml|launch|test|urdf)$/.test(path) ? [xml()] : [];
    return [
      ...[lineNumbers(), history(), drawSelection(), highlightActiveLine(), bracketMatching(), indentOnInput(), indentUnit.of("    ")],
      syntaxHighlighting(defaultHighlightStyle),
      keymap.of([{ key: "Mod-s", run: () => this.save() }, ...defaultKeymap, ...historyKeymap, indentWithTab]),
      EditorView.contentAttributes.of({ "aria-label": "Text of the file" }),
      EditorView.domEventHandlers({ blur: () => void this.save() }),
      ...language,
    ];
  }
}

function listFiles(hub, editor) {
  const paths = [...hub.files.keys()].filter((path) => !NOT_LISTED.test(path)).sort();
  $("files").replaceChildren(
    ...paths.map((path) => {
      const name = path.slice(HOME.length + 1);
      const isFolder = Boolean((hub.files.get(path)?.[0] ?? 0) & IS_FOLDER);
      const depth = name.split("/").length - 1;
      const item = Object.assign(document.createElement(isFolder ? "div" : "button"), { title: name });
      item.textContent = name.split("/").at(-1) + (isFolder ? "/" : "");
      item.style.marginLeft = `${depth * 0.9}rem`;
      if (!isFolder) item.onclick = () => editor.open(path);
      return item;
    }),
  );
}

/** Packs or unpacks an archive with Python. Returns what it prints. */
async function archive(hub, order, path, files = {}) {
  let printed = "";
  const argv = ["python3", "-m", "pipros.tab.archives", order, path];
  await hub.start({ argv, files }, (text) => (printed += text)).ended;
  return printed.trim();
}

async function download(hub) {
  say(await archive(hub, "pack", PACKED));
  const packed = hub.files.get(PACKED);
  if (!packed) return; // it said why
  const href = URL.createObjectURL(new Blob([packed[1]], { type: "application/zip" }));
  hub.writeFile(PACKED, null);
  Object.assign(document.createElement("a"), { href, download: "student.zip" }).click();
  setTimeout(() => URL.revokeObjectURL(href), 10_000);
}

async function openZip(hub, file) {
  const content = new Uint8Array(await file.arrayBuffer());
  say(`${file.name}: ${await archive(hub, "unpack", OPENED, { [OPENED]: [0o644, content] })}`);
}

async function main() {
  if (!(await isIsolated())) return;
  const hub = new Hub(startWorker);
  const editor = new Editor(hub);
  const keep = await keepFiles(hub.files, (error) => say(`files are not kept (${error?.name}): download them, and remove some`));
  let listing = 0;
  hub.onFile = (path) => {
    keep(path);
    clearTimeout(listing);
    listing = setTimeout(() => listFiles(hub, editor), 100);
  };
  listFiles(hub, editor);
  let count = 0;
  const pictures = new Pictures(hub, $("side"), $("choices"));
  const edit = (path) => {
    pictures.show(null);
    editor.open(path);
  };
  const open = () => {
    const terminal = new Terminal(hub, `Terminal ${++count}`, edit, (line) => pictures.open(line));
    $("terminals").append(terminal.element);
    return terminal;
  };
  Array.from({ length: TERMINALS }, open)[0].input.focus();
  $("new-terminal").onclick = () => open().input.focus();
  $("new-file").onclick = () => {
    const name = prompt("Path of the file in the home folder");
    if (name) edit(`${HOME}/${name}`);
  };
  $("download").onclick = () => download(hub);
  $("open-zip").onchange = () => openZip(hub, $("open-zip").files[0]);
  document.querySelectorAll("header [disabled]").forEach((each) => each.removeAttribute("disabled"));
  say("");
  void navigator.locks.request("pipros-tab", { ifAvailable: true }, (lock) => {
    if (!lock) say("Another tab has these files open. Each tab sees the other's changes after a reload.");
    return lock && new Promise(() => {}); // held as long as the page is open
  });
}

void main();
