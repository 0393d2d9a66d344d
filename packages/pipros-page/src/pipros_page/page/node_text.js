// The name of a node, as tables show it.

import { live } from "./live.js";

export const nodeText = (name) => (name === live.node ? "this page" : name);
