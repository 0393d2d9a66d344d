// The state of the connection on a node's page: in the head, and in the look of the values.

import { live } from "./live.js";

const element = (id) => /** @type {any} */ (document.getElementById(id));

// `main` is the id of the content, `node` what the user calls the program, `ended()` a text once the user has ended it, and `buttons` the
// ids of buttons that need the node.
export function showConnection(main, node, { ended = () => /** @type {string} */ (""), buttons = [] } = {}) {
  function show() {
    element("locked").hidden = !live.isRefused;
    element(main).hidden = live.isRefused;
    element(main).classList.toggle("outdated", !live.isCurrent);
    element("system").className = live.isCurrent ? "" : "lost";
    element("system").textContent = ended() || live.problem(node);
    for (const id of buttons) element(id).disabled = !live.isCurrent;
  }
  for (const event of ["state", "silence"]) live.addEventListener(event, show);
  show();
}
