"""The share of the window that pictures cover: camera images, charts, graphs and scenes."""

from playwright.sync_api import Page as Tab

# An image is as large as what is drawn of it (`object-fit: contain`). What panels and the window cut does
# not count.
_SHARE = """() => {
  let sum = 0;
  const all = "canvas:not(.over, .u-wrap canvas), svg.canvas, img, .u-over";
  for (const each of document.querySelectorAll(all)) {
    if (!each.checkVisibility({ visibilityProperty: true })) continue;
    let { left, top, right, bottom } = each.getBoundingClientRect();
    if (getComputedStyle(each).objectFit === "contain") {
      const scale = Math.min((right - left) / each.width, (bottom - top) / each.height);
      const [w, h] = [each.width * scale / 2, each.height * scale / 2];
      const [x, y] = [(left + right) / 2, (top + bottom) / 2];
      [left, right, top, bottom] = [x - w, x + w, y - h, y + h];
    }
    for (let around = each.parentElement; around; around = around.parentElement) {
      const box = around === document.documentElement ? new DOMRect(0, 0, innerWidth, innerHeight)
        : getComputedStyle(around).overflow === "visible" ? null : around.getBoundingClientRect();
      if (!box) continue;
      [left, right] = [Math.max(left, box.left), Math.min(right, box.right)];
      [top, bottom] = [Math.max(top, box.top), Math.min(bottom, box.bottom)];
    }
    sum += Math.max(0, right - left) * Math.max(0, bottom - top);
  }
  return sum / (innerWidth * innerHeight);
}"""


def share_of_pictures(tab: Tab) -> float:
    """Return the share of pictures in the area of the window, from 0 to 1."""
    return float(tab.evaluate(_SHARE))
