// Links to a scene: its displays, options and view as text for the address, compressed.

const LONGEST_LINK = 30000; // characters
const MAX_BYTES = 2e6; // maximum size of a link's content
const DEEPEST = 40;
const ROOT = "Visualization Manager";

// Returns what a link contains of a configuration, as JSON.
export function stateText(config) {
  const { "Global Options": options = {}, Displays = [], Views = {} } = config[ROOT] ?? {};
  return JSON.stringify({ options, displays: Displays, view: Views.Current ?? {} });
}

// Returns a promise of the text of a link; null if it would be too long.
export async function packed(state) {
  const stream = new Blob([state]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  if (bytes.length > (LONGEST_LINK * 3) / 4) return null;
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

// Returns a promise of a copy of a configuration with the content of a link. Throws an Error if the link is damaged.
export async function withLink(config, text) {
  let state;
  try {
    state = JSON.parse(await unpackedState(text));
  } catch {
    throw new Error("the link to the scene is damaged; the file is shown");
  }
  const copy = structuredClone(config);
  const root = copy[ROOT] ??= {};
  root["Global Options"] = map(texts(state?.options));
  const displays = texts(state?.displays);
  root.Displays = Array.isArray(displays) ? displays.map(map) : [];
  root.Views = { ...map(root.Views), Current: map(texts(state?.view)) };
  return copy;
}

async function unpackedState(text) {
  if (text.length > LONGEST_LINK) throw new Error("too long");
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (letter) => letter.charCodeAt(0));
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
  const parts = [];
  let size = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return new Blob(parts).text();
    size += value.length;
    if (size > MAX_BYTES) {
      await reader.cancel();
      throw new Error("too large");
    }
    parts.push(value);
  }
}

const map = (value) => (typeof value === "object" && value && !Array.isArray(value) ? value : {});

// Returns a value with strings in place of numbers and booleans, as in a file that was read.
function texts(value, depth = 0) {
  if (depth > DEEPEST) return "";
  if (Array.isArray(value)) return value.map((each) => texts(each, depth + 1));
  if (typeof value !== "object" || value === null) return String(value ?? "");
  return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, texts(each, depth + 1)]));
}
