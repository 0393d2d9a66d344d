import assert from "node:assert/strict";
import test from "node:test";
import { LogGroups } from "../page/log_groups.js";

const entry = (level, node, text, stamp = 0) => [level, node, text, stamp];

test("equal entries that follow one another are one row with a count and the newest time", () => {
  const groups = new LogGroups();
  groups.set([entry(2, "/a", "loop", 1), entry(2, "/a", "loop", 2), entry(2, "/b", "loop", 3)]);
  groups.add([entry(4, "/b", "loop", 4), entry(4, "/b", "loop", 5), entry(4, "/b", "end", 6)]);
  assert.deepEqual(groups.all.map(({ entry: [, node, text, stamp], count }) => [node, text, stamp, count]),
    [["/a", "loop", 2, 2], ["/b", "loop", 3, 1], ["/b", "loop", 5, 2], ["/b", "end", 6, 1]]);
});

test("without folding each entry is a row", () => {
  const groups = new LogGroups();
  groups.isFolding = false;
  groups.set([entry(2, "/a", "same"), entry(2, "/a", "same")]);
  assert.deepEqual(groups.all.map(({ count }) => count), [1, 1]);
});

test("the next error follows the last one, and then the first one again", () => {
  const groups = new LogGroups();
  assert.equal(groups.nextError(-1), -1);
  groups.set([entry(2, "/a", "a"), entry(8, "/a", "b"), entry(2, "/a", "c"), entry(16, "/a", "d")]);
  assert.deepEqual([groups.nextError(-1), groups.nextError(1), groups.nextError(3)], [1, 3, 1]);
});
