// Moving a panel by dragging its grip: the place to which it would go is marked in the panel under the pointer.

const CENTRE = 0.28; // part of a panel's size; a panel dropped farther than this from the centre is placed at the nearest edge

// Calls `onDrop` with the other panel and its side: left, right, above, below or centre.
export function makeDraggable(element, grip, onDrop) {
  let drop = null; // {target, side}

  function mark(next) {
    if (drop) delete drop.target.dataset.drop;
    drop = next;
    if (drop) drop.target.dataset.drop = drop.side;
  }

  grip.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    grip.setPointerCapture(event.pointerId);
    element.classList.add("dragged");
  });
  grip.addEventListener("pointermove", (event) => {
    if (element.classList.contains("dragged")) mark(dropAt(event, element));
  });
  for (const kind of ["pointerup", "pointercancel"]) grip.addEventListener(kind, () => {
    element.classList.remove("dragged");
    const found = drop;
    mark(null);
    if (found && kind === "pointerup") onDrop(found.target, found.side);
  });
}

function dropAt({ clientX, clientY }, dragged) {
  const target = document.elementsFromPoint(clientX, clientY).map((each) => each.closest("section.panel")).find(Boolean);
  if (!(target instanceof HTMLElement) || target === dragged) return null;
  const bounds = target.getBoundingClientRect();
  const [x, y] = [(clientX - bounds.left) / bounds.width - 0.5, (clientY - bounds.top) / bounds.height - 0.5];
  const edge = Math.abs(x) > Math.abs(y) ? (x < 0 ? "left" : "right") : y < 0 ? "above" : "below";
  return { target, side: Math.max(Math.abs(x), Math.abs(y)) < CENTRE ? "centre" : edge };
}
