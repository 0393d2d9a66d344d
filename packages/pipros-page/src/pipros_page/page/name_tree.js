// Items whose names have parts between slashes, as a tree.

// Returns the branches {below, item} by their parts, each with those below it. Parts beyond the `deepest` are one part.
export function nameTree(items, nameOf, deepest = Infinity) {
  const root = { below: new Map(), item: null };
  for (const item of items) {
    let branch = root;
    const parts = nameOf(item).split("/").filter(Boolean);
    if (!parts.length) parts.push(nameOf(item));
    if (parts.length > deepest) parts.push(parts.splice(deepest - 1).join("/"));
    for (const part of parts) {
      if (!branch.below.has(part)) branch.below.set(part, { below: new Map(), item: null });
      branch = branch.below.get(part);
    }
    branch.item = item;
  }
  return root.below;
}
