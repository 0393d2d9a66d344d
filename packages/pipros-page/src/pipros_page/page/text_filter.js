// Text filters that users type.

// Returns a function that returns whether a text contains the typed words verbatim. "-word" excludes texts with the word,
// "/…/" is a regular expression, and "-/…/" excludes the texts that it matches. A malformed expression counts as words.
// Case is ignored.
export function textFilter(typed) {
  const conditions = split(typed).map(condition);
  return (text) => conditions.every((holds) => holds(text));
}

// Words without a sign stay together.
function split(typed) {
  const parts = typed.trim().split(/(?:^|\s)(-?\/(?:[^/\\]|\\.)+\/|-\S+)(?=\s|$)/);
  return parts.map((part) => part.trim()).filter(Boolean);
}

function condition(part) {
  const isExcluded = part.startsWith("-") && part.length > 1;
  const wanted = isExcluded ? part.slice(1) : part;
  const isExpression = wanted.length > 2 && wanted.startsWith("/") && wanted.endsWith("/");
  const matches = isExpression ? matcher(wanted.slice(1, -1)) : contains(wanted);
  return (text) => matches(text) !== isExcluded;
}

function matcher(pattern) {
  try {
    const expression = new RegExp(pattern, "i");
    return (text) => expression.test(text);
  } catch {
    return contains(pattern);
  }
}

function contains(part) {
  const wanted = part.toLowerCase();
  return (text) => text.toLowerCase().includes(wanted);
}
