// Reads and writes properties in a configuration. Values stay texts in it, so unknown keys and their order survive.

import { parsedColour } from "./colours.js";
import { drawable } from "./pose.js";

// Returns rviz's name of a class, also for ROS 2 files.
export const className = (text) => text.replace(/^rviz_(default_plugins|common)\//, "rviz/");

const isMap = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

// The typed properties in a map of texts. Changes are written into that map.
export class Properties {
  constructor(schema, config) {
    this.schema = schema;
    this.config = config;
  }

  // Returns the value at a path of names, such as `get("Covariance", "Alpha")`.
  get(...path) {
    const [definition, holder] = this.find(path);
    if (!definition) throw new Error(`no property ${path.join("/")}`);
    return typed(definition, holder?.[definition[0]]);
  }

  set(path, value) {
    const [definition] = this.find(path);
    let holder = this.config;
    for (const name of path.slice(0, -1)) {
      if (!isMap(holder[name])) holder[name] = holder[name] === undefined ? {} : { Value: holder[name] };
      holder = holder[name];
    }
    const name = path.at(-1);
    const text = asText(definition?.[1], value);
    if (isMap(holder[name]) && definition?.[1] !== "vector") holder[name].Value = text;
    else if (isMap(holder[name]) && isMap(text)) Object.assign(holder[name], text);
    else holder[name] = definition && childrenOf(definition) ? { Value: text } : text;
  }

  find(path) {
    let schema = this.schema;
    let holder = this.config;
    let definition;
    path.forEach((name, depth) => {
      definition = schema.find((each) => each[0] === name);
      if (!definition || depth === path.length - 1) return;
      holder = isMap(holder?.[name]) ? holder[name] : undefined;
      schema = childrenOf(definition) ?? [];
    });
    return [definition, holder];
  }
}

// Returns the definitions of a property's children, or undefined.
export function childrenOf([, kind, , third, fourth]) {
  return kind === "group" || kind === "switch" ? third : kind === "choice" ? fourth : undefined;
}

function typed([, kind, fallback], found) {
  if (kind === "vector") return vector(found, fallback);
  const text = isMap(found) ? found.Value : found;
  if (typeof text !== "string" || (text === "" && kind !== "text" && kind !== "topic")) return fallback;
  if (kind === "bool" || kind === "switch") return truth(text, fallback);
  if (kind === "int") return finite(parseInt(text, 10), fallback);
  if (kind === "float") return finite(Number(text), fallback);
  if (kind === "colour") return parsedColour(text, fallback);
  if (kind === "frame") return text === "<Fixed Frame>" ? text : text.replace(/^\//, "");
  return text === "~" ? "" : text;
}

export const truth = (text, fallback = true) => (/^(true|1|yes|on)$/i.test(text ?? "") ? true : /^(false|0|no|off)$/i.test(text ?? "")
  ? false : fallback);
const finite = (value, fallback) => (Number.isFinite(value) ? drawable(value) : fallback);

function vector(found, fallback) {
  if (isMap(found)) return ["X", "Y", "Z"].map((axis, i) => finite(Number(found[axis] ?? fallback[i]), fallback[i]));
  const parts = typeof found === "string" ? found.split(/[;,]/).map(Number) : [];
  return parts.length === 3 && parts.every(Number.isFinite) ? parts.map(drawable) : [...fallback];
}

function asText(kind, value) {
  if (kind === "vector") return { X: String(value[0]), Y: String(value[1]), Z: String(value[2]) };
  if (kind === "colour") return value.join("; ");
  return String(value);
}
