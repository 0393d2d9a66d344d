// The drawing as a file: SVG, PNG or DOT.

import { live } from "../live.js";
import { download, h } from "../dom.js";

const PNG_SCALE = 2;

// Downloads the graph of `options` in a format. Throws an Error if the server cannot draw it.
export async function savePicture(options, format) {
  const text = await live.act("picture", { ...options, format: format === "dot" ? "dot" : "svg" });
  if (format === "png") download("rqt_graph.png", await asPng(text));
  else download(`rqt_graph.${format}`, text, format === "svg" ? "image/svg+xml" : "text/vnd.graphviz");
}

async function asPng(svg) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = h("canvas", { width: image.width * PNG_SCALE, height: image.height * PNG_SCALE });
  const context = canvas.getContext("2d");
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => { canvas.toBlob(resolve, "image/png"); });
}
