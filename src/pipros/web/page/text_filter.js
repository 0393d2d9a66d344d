// Filters of texts as users type them.

// Returns a function of a text: whether it contains every word, and none that begins with "-". "/…/" is a regular
// expression, "-/…/" excludes what it matches; one that is malformed is taken as a part of the text. Case is ignored.
export function textFilter(typed) {
  const conditions = split(typed).map(condition);
  return (text) => conditions.every((holds) => holds(text));
}

const split = (typed) => typed.match(/-?\/(?:[^/\\]|\\.)+\/(?=\s|$)|\S+/g) ?? [];

function condition(word) {
  const isExcluded = word.startsWith("-") && word.length > 1;
  const part = isExcluded ? word.slice(1) : word;
  const matches = part.length > 2 && part.startsWith("/") && part.endsWith("/") ? matcher(part.slice(1, -1)) : contains(part);
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
