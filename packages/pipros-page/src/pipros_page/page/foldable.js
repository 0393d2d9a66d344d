// A tree that is drawn anew with each update, and whose branches stay as the user has folded them.

// `choose(name)` is called with the `data-name` of a pressed button. Returns what to call after drawing.
export function foldable(body, choose) {
  const closed = new Set(); // paths of branches
  body.addEventListener("click", (event) => {
    const button = event.target instanceof Element ? event.target.closest("button") : null;
    if (button) choose(button.dataset.name);
  });
  body.addEventListener("toggle", ({ target: { open, dataset } }) => {
    if (dataset.path) closed[open ? "delete" : "add"](dataset.path);
  }, { capture: true });
  return () => { for (const branch of body.querySelectorAll("details[data-path]")) branch.open = !closed.has(branch.dataset.path); };
}
