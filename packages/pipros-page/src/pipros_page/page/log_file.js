// Files of log entries: one JSON object per line.

const FIELDS = { level: "number", node: "string", text: "string", stamp: "number", file: "string", line: "number", function: "string" };
const NAMES = Object.keys(FIELDS); // in the order of an entry's values
const MAX_CHARACTERS = 100e6;

export const asLines = (entries) => entries.map((entry) =>
  `${JSON.stringify(Object.fromEntries(NAMES.map((name, index) => [name, entry[index]])))}\n`).join("");

// Returns the entries of a file. Throws an Error that names the first invalid line.
export function fromLines(text) {
  if (text.length > MAX_CHARACTERS) throw new Error(`it has ${text.length} characters; the limit is ${MAX_CHARACTERS}`);
  const entries = [];
  text.split("\n").forEach((line, index) => {
    if (line.trim()) entries.push(entryIn(line, index + 1));
  });
  return entries;
}

function entryIn(line, number) {
  let values;
  try {
    values = JSON.parse(line) ?? {};
  } catch {
    throw new Error(`line ${number} is not JSON`);
  }
  for (const [name, type] of Object.entries(FIELDS)) {
    if (typeof values[name] !== type) throw new Error(`line ${number}: ${name} must be a ${type}`);
  }
  return NAMES.map((name) => values[name]);
}
