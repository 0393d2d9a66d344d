// The page: terminals, the files of the home folder, and an editor.

import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { python } from "@codemirror/lang-python";
import { xml } from "@codemirror/lang-xml";
import { bracketMatching, defaultHighlightStyle, indentOnInput, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { EditorState } from "@codemirror/state";
import { EditorView, drawSelection, highlightActiveLine, keymap, lineNumbers } from "@codemirror/view";
import { download, h, replace } from "./dom.js";
import { Hub } from "./hub.mjs";
import { IS_FOLDER } from "./packets.mjs";
import { Pictures } from "./pictures.js";
import { keepFiles } from "./store.js";
import { Terminal } from "./terminal.js";

const HOME = "/home/student";
const PACKED = `${HOME}/.ros/student.zip`; // neither listed nor kept
const OPENED = "/tmp/opened.zip"; // in one worker alone
const TERMINALS = 3;
const NO_USE = /\/(build|devel|\.catkin_workspace|\.ros)(\/|$)/; // not listed, as they are made by commands
const WELCOME = "This is a computer with ROS 1 in your browser. Nothing is installed, and your files stay in this browser.\n" +
  "\x1b[32mhelp\x1b[0m lists the commands. Steps, beside the files, leads through the first package, from " +
  "\x1b[32mmkdir feature\x1b[0m on.";
const RAN = "pipros-tab-steps";
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
  const registered = navigator.serviceWorker?.register(new URL("headers.js", import.meta.url));
  if (crossOriginIsolated) {
    sessionStorage.removeItem(RELOADED);
    return true;
  }
  if (!isSecureContext) say("Browsers share memory only on https pages, and on localhost: use one of these addresses.");
  else if (!registered || sessionStorage.getItem(RELOADED)) say("This browser does not let pages share memory: try another one.");
  else {
    sessionStorage.setItem(RELOADED, "yes");
    await registered;
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
    $("editor-name").title = path.replace(`${HOME}/`, "");
    $("editor-name").textContent = `\u200e${$("editor-name").title}`; // written from left to right, although the start is cut
    const doc = new TextDecoder().decode(this.hub.files.get(path)?.[1]);
    this.view.setState(EditorState.create({ doc, extensions: this.#extensions(path) }));
    this.saved = this.view.state.doc;
    this.view.focus();
  }

  save() {
    const { doc } = this.view.state;
    if (this.saved && !doc.eq(this.saved)) {
      this.hub.writeFile(this.path, new TextEncoder().encode(doc.toString()));
      say(`saved ${$("editor-name").title}`);
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
  const paths = [...hub.files.keys()].filter((path) => !NO_USE.test(path)).sort();
  replace($("files"), paths.map((path) => {
    const name = path.slice(HOME.length + 1);
    const parents = name.split("/");
    const text = parents.pop();
    const attributes = { title: name, style: `margin-left: ${parents.length * 0.9}rem` };
    if ((hub.files.get(path)?.[0] ?? 0) & IS_FOLDER) return h("div", attributes, `${text}/`);
    return h("button", { ...attributes, onclick: () => editor.open(path) }, text);
  }));
}

/** Returns the path of a file, which may be new, from what a user has typed. Throws an error that says why it cannot be one. */
function filePath(hub, typed) {
  const name = typed.trim().replace(/^~\//, "").replace(`${HOME}/`, "").replace(/\/$/, "");
  const path = `${HOME}/${name}`;
  const isElsewhere = !name || /^\/|^~|(^|\/)\.{1,2}(\/|$)/.test(name);
  if (isElsewhere) throw Error(`${typed} is not a path in the home folder, such as my_robot/scripts/talker.py`);
  const isFolder = (at) => hub.files.has(at) && hub.files.get(at)[0] & IS_FOLDER;
  const parents = [...path.matchAll(/\//g)].map(({ index }) => path.slice(0, index)).filter((each) => hub.files.has(each));
  if (isFolder(path)) throw Error(`${typed} is a folder: add the name of a file, such as ${name}/talker.py`);
  if (!parents.every(isFolder)) throw Error(`${typed} is below a file: type another path`);
  return path;
}

/** Ticks the steps of the case study: `data-ran` is the line that a step asks for, `data-file` a file, and `data-has` what it contains. */
function tickSteps(hub, line = "") {
  const lines = JSON.parse(localStorage.getItem(RAN) ?? "[]"); // what steps have asked for, and has been done
  const texts = [...hub.files].map(([path, [, content]]) => [path, content]);
  for (const step of /** @type {any} */ (document.querySelectorAll("#steps li"))) {
    const { ran, file, has = "" } = step.dataset;
    const isIn = ([path, content]) => path.endsWith(`/${file}`) && new RegExp(has, "m").test(new TextDecoder().decode(content));
    if (ran && new RegExp(ran).test(line) && !lines.includes(ran)) lines.push(ran);
    step.classList.toggle("done", file ? texts.some(isIn) : lines.includes(ran));
  }
  localStorage.setItem(RAN, JSON.stringify(lines));
}

/** Removes all files and the history after a question. */
function startAnew(hub) {
  if (!confirm("Remove all files of this tab, and start anew? Download files keeps a copy.")) return;
  localStorage.clear();
  for (const path of [...hub.files.keys()]) hub.writeFile(path, null);
  location.reload();
}

/** Packs or unpacks an archive with Python. Returns what it prints. */
async function archive(hub, order, path, files = {}) {
  let printed = "";
  await hub.start({ argv: ["python3", "-m", "pipros_tab.archives", order, path], files }, (text) => (printed += text)).ended;
  return printed.trim();
}

async function downloadFiles(hub) {
  say(await archive(hub, "pack", PACKED));
  const packed = hub.files.get(PACKED);
  if (!packed) return; // it said why
  hub.writeFile(PACKED, null);
  download("student.zip", packed[1], "application/zip");
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
  const showFiles = () => {
    listFiles(hub, editor);
    tickSteps(hub);
  };
  let listing = 0;
  hub.onFile = (path) => {
    keep(path);
    clearTimeout(listing);
    listing = setTimeout(showFiles, 100);
  };
  showFiles();
  let count = 0;
  const pictures = new Pictures(hub, $("side"), $("choices"));
  const edit = (typed) => {
    try {
      const path = filePath(hub, typed);
      pictures.show("files");
      editor.open(path);
      say("");
    } catch (error) {
      say(error.message);
    }
  };
  const open = () => {
    const shown = (line) => pictures.open(line);
    const welcome = count ? "\x1b[32mhelp\x1b[0m lists the commands." : WELCOME;
    const terminal = new Terminal(hub, `Terminal ${++count}`, edit, shown, (line) => tickSteps(hub, line), welcome);
    $("terminals").append(terminal.element);
    return terminal;
  };
  Array.from({ length: TERMINALS }, open)[0].input.focus();
  $("new-terminal").onclick = () => open().input.focus();
  $("new-file").onclick = () => {
    const name = prompt("Path of the file in the home folder, such as my_robot/scripts/talker.py");
    if (name) edit(name);
  };
  $("anew").onclick = () => startAnew(hub);
  $("download").onclick = () => downloadFiles(hub);
  $("open-zip").onchange = () => openZip(hub, $("open-zip").files[0]);
  document.querySelectorAll("header [disabled]").forEach((each) => each.removeAttribute("disabled"));
  say("");
  void navigator.locks.request("pipros-tab", { ifAvailable: true }, (lock) => {
    if (!lock) say("Another tab has these files open. Each tab sees the other's changes after a reload.");
    return lock && new Promise(() => {}); // held as long as the page is open
  });
}

void main();
