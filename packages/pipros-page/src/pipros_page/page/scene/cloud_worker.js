// Worker that decodes large clouds, so that the page's thread does not stop for them.

import { cloudArrays } from "./cloud_arrays.js";
import { columnsOf } from "./cloud_colours.js";

self.onmessage = ({ data: { turn, head, buffer, offset, options } }) => {
  try {
    const arrays = cloudArrays(columnsOf(head, new Uint8Array(buffer, offset)), options);
    const buffers = [arrays.positions.buffer, arrays.tints.buffer, ...[...arrays.columns.values()].map((column) => column.buffer)];
    self.postMessage({ turn, arrays }, /** @type {any} */ ([...new Set(buffers)]));
  } catch (error) {
    self.postMessage({ turn, problem: error.message });
  }
};
