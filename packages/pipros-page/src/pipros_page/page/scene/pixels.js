// What a camera sees, as pixels.

// Returns the colours (RGBA) of a rectangle [left, bottom, width, height] of a render target, in which the scene is drawn on a transparent
// background. Rows begin with the lowest.
export function pixelsOf({ renderer, world }, camera, target, [left, bottom, width, height]) {
  const pixels = new Uint8Array(width * height * 4);
  const alpha = renderer.getClearAlpha();
  try {
    renderer.setClearColor(0x000000, 0);
    renderer.setRenderTarget(target);
    renderer.clear();
    renderer.render(world, camera);
    renderer.readRenderTargetPixels(target, left, bottom, width, height, pixels);
  } finally {
    renderer.setRenderTarget(null);
    renderer.setClearAlpha(alpha);
  }
  return pixels;
}
