// Curves as texts, for addresses and for what users type.
//
//   /imu/angular_velocity/x                      a field
//   /a/pose/x:y                                  two fields
//   /cmd_vel=hypot(m.linear.x, m.linear.y)       an expression over the message m
//   /odom/twist/twist/linear/x;d;r               the derivative, on the right axis
//   /tf{m.child_frame_id == "base"}/pose/x       only messages for which the expression is true
//
// In addresses, `line:2.5` is a line at a value, and `at:12.5` a moment that is shown.

const AXES = ["received", "stamp", "ros", "xy"];
const OPTION = /^(axis|marks|show|line|at):([\w.+-]*)$/;
const FLAGS = /(?:;[dr]){0,9}$/;

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
  if (/[[={]/.test(text)) return [text];
  const [, names, flags] = /^(.*?)((?:;[dr]){0,9})$/.exec(text);
  const [first, ...others] = names.split(":");
  return [first, ...others.map((other) => `${first.slice(0, first.lastIndexOf("/"))}/${other}`)].map((name) => name + flags);
}

const rooted = (text) => (text.startsWith("/") ? text : `/${text}`);

// The texts of the curves that a user typed or an address names.
export const curveTexts = (text) => parts(text)
  .flatMap((part) => (/[={]/.test(part) ? [part] : part.split(/\s+/)))
  .map(rooted).flatMap(expanded);

// Returns {curves, axis, hasMarks, hasStatistics, lines, at} of an address; `at` is null without a moment.
export function parsedPlot(text) {
  const words = parts(text);
  const numbers = (name) => words.map((word) => OPTION.exec(word)).filter((found) => found?.[1] === name)
    .map((found) => Number(found[2])).filter(Number.isFinite);
  const axis = words.map((word) => /^axis:(\w+)$/.exec(word)?.[1]).find((name) => AXES.includes(name)) ?? "received";
  const curves = words.filter((word) => !OPTION.test(word));
  return { curves: curves.flatMap(curveTexts), axis, hasMarks: words.includes("marks:log"),
    hasStatistics: words.includes("show:statistics"), lines: numbers("line"), at: numbers("at")[0] ?? null };
}

export const plotText = (curves, axis, hasMarks, { hasStatistics = false, lines = [] } = {}) => [
  ...(axis === "received" ? [] : [`axis:${axis}`]), ...(hasMarks ? ["marks:log"] : []), ...(hasStatistics ? ["show:statistics"] : []),
  ...lines.map((value) => `line:${value}`), ...curves,
].join(",");

// Returns the topic of a field: what is before a condition or an expression.
export const topicBefore = (field) => /^[^{=]*/.exec(field)[0];

// Returns a field of a topic with another condition; with "", without any.
export function withCondition(field, topic, condition) {
  const old = conditionOf(field);
  const rest = field.slice(topic.length + (old ? old.length + 2 : 0));
  return `${topic}${condition ? `{${condition}}` : ""}${rest}`;
}

// Returns the condition in a field; empty for none.
export function conditionOf(field) {
  const begin = topicBefore(field).length;
  return field[begin] === "{" ? field.slice(begin + 1, closing(field, begin)) : "";
}

// The index of the brace that closes the one at `begin`, outside of quotes; the end of the text if there is none.
function closing(text, begin) {
  let [depth, quote] = [0, ""];
  for (let at = begin; at < text.length; at += 1) {
    const sign = text[at];
    if (quote) quote = sign === quote ? "" : quote;
    else if ("'\"".includes(sign)) quote = sign;
    else if (sign === "{") depth += 1;
    else if (sign === "}" && (depth -= 1) === 0) return at;
  }
  return text.length;
}

// Returns {field, isRate, isRight}.
export function parsedCurve(text) {
  const flags = FLAGS.exec(text)[0];
  return { field: text.slice(0, text.length - flags.length), isRate: flags.includes(";d"), isRight: flags.includes(";r") };
}

export const curveText = ({ field, isRate, isRight }) => `${field}${isRate ? ";d" : ""}${isRight ? ";r" : ""}`;
