// Curves as texts, for addresses and for what users type.
//
//   /imu/angular_velocity/x                      a field
//   /a/pose/x:y                                  two fields
//   /cmd_vel=hypot(m.linear.x, m.linear.y)       an expression over the message m
//   /odom/twist/twist/linear/x;d;r               the derivative, on the right axis

const AXES = ["received", "stamp", "ros", "xy"];
const FLAGS = /(?:;[dr])*$/;

// Splits at commas outside of brackets and quotes.
function parts(text) {
  const found = [""];
  let depth = 0;
  let quote = "";
  for (const sign of text) {
    if (quote) quote = sign === quote ? "" : quote;
    else if ("'\"".includes(sign)) quote = sign;
    else if ("([{".includes(sign)) depth += 1;
    else if (")]}".includes(sign)) depth -= 1;
    if (sign === "," && depth <= 0 && !quote) found.push("");
    else found[found.length - 1] += sign;
  }
  return found.map((part) => part.trim()).filter(Boolean);
}

// `/a/pose/x:y` names two fields.
function expanded(text) {
  if (text.includes("[") || text.includes("=")) return [text];
  const [, names, flags] = /^(.*?)((?:;[dr])*)$/.exec(text);
  const [first, ...others] = names.split(":");
  return [first, ...others.map((other) => `${first.slice(0, first.lastIndexOf("/"))}/${other}`)].map((name) => name + flags);
}

const rooted = (text) => (text.startsWith("/") ? text : `/${text}`);

// The texts of the curves that a user typed or an address names.
export const curveTexts = (text) => parts(text)
  .flatMap((part) => (part.includes("=") ? [part] : part.split(/\s+/)))
  .map(rooted).flatMap(expanded);

// Returns {curves, axis, hasMarks} of an address.
export function parsedPlot(text) {
  const words = parts(text);
  const axis = words.map((word) => /^axis:(\w+)$/.exec(word)?.[1]).find((name) => AXES.includes(name)) ?? "received";
  const curves = words.filter((word) => !/^(axis|marks):\w*$/.test(word));
  return { curves: curves.flatMap(curveTexts), axis, hasMarks: words.includes("marks:log") };
}

export const plotText = (curves, axis, hasMarks) => [
  ...(axis === "received" ? [] : [`axis:${axis}`]), ...(hasMarks ? ["marks:log"] : []), ...curves,
].join(",");

// Returns {field, isRate, isRight}.
export function parsedCurve(text) {
  const flags = FLAGS.exec(text)[0];
  return { field: text.slice(0, text.length - flags.length), isRate: flags.includes(";d"), isRight: flags.includes(";r") };
}

export const curveText = ({ field, isRate, isRight }) => `${field}${isRate ? ";d" : ""}${isRight ? ";r" : ""}`;
