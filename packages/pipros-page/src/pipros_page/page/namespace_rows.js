// Rows of a table as a tree of namespaces.

// Returns the rows sorted by name, with a row {name: "/robot/", depth, count, isOpen} before the rows of each
// namespace that has several. If `isClosed(name)`, the namespace's rows are left out. All rows have a `depth`.
export function namespaceRows(rows, isClosed) {
  const sorted = [...rows].sort((one, other) => (one.name < other.name ? -1 : 1));
  return below(sorted, "/", 0, isClosed);
}

function below(rows, namespace, depth, isClosed) {
  const groups = new Map();
  for (const row of rows) {
    const end = row.name.indexOf("/", namespace.length);
    const key = end < 0 ? row.name : row.name.slice(0, end + 1);
    groups.set(key, [...(groups.get(key) ?? []), row]);
  }
  return [...groups].flatMap(([name, members]) => {
    if (members.length === 1) return { ...members[0], depth };
    const head = { name, depth, count: members.length, isOpen: !isClosed(name) };
    return [head, ...(head.isOpen ? below(members, name, depth + 1, isClosed) : [])];
  });
}
