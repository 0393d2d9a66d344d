import assert from "node:assert/strict";
import test from "node:test";
import { cloudArrays } from "../page/scene/cloud_arrays.js";
import { columnsOf } from "../page/scene/cloud_colours.js";

const OPTIONS = { transformer: "", channel: "intensity", rainbow: false, minColor: [0, 0, 0], maxColor: [255, 100, 0], autoBounds: true };
const columns = (rows, names) => new Map(names.map((name, at) => [name, Float32Array.from(rows, (row) => row[at])]));

test("positions follow one another, and intensities become colours between the bounds", () => {
  const made = cloudArrays(columns([[1, 2, 3, 10], [4, 5, 6, 20]], ["x", "y", "z", "intensity"]), OPTIONS);
  assert.deepEqual([...made.positions], [1, 2, 3, 4, 5, 6]);
  assert.deepEqual([...made.tints], [0, 0, 0, 255, 255, 100, 0, 255]);
  assert.deepEqual([made.count, made.transformer, made.hasAlpha], [2, "Intensity", false]);
});

test("points that are not finite are left out of all columns", () => {
  const made = cloudArrays(columns([[1, 2, 3, 10], [NaN, 5, 6, 20], [7, 8, 9, 30]], ["x", "y", "z", "intensity"]), OPTIONS);
  assert.deepEqual([...made.positions], [1, 2, 3, 7, 8, 9]);
  assert.deepEqual([...made.columns.get("intensity")], [10, 30]);
});

test("colours by an axis use the coordinates in the fixed frame", () => {
  const half = Math.SQRT1_2; // a turn of 90 degrees about x: y becomes z
  const bounds = { autoAxis: false, axisBounds: [0, 1] };
  const options = { ...OPTIONS, ...bounds, transformer: "AxisColor", axis: "Z", pose: [0, 0, 5, half, 0, 0, half] };
  const cloud = columns([[0, -5, 9], [0, -4, 9]], ["x", "y", "z"]);
  const tints = [...cloudArrays(cloud, { ...options, isFixed: true }).tints];
  assert.deepEqual(tints, [...cloudArrays(columns([[0, 0, 0], [0, 0, 1]], ["x", "y", "z"]), { ...options, isFixed: false }).tints]);
});

test("packed colours keep their alpha, and grey is their mean", () => {
  const cloud = columns([[0, 0, 0]], ["x", "y", "z"]);
  cloud.set("rgba", Uint32Array.of(0x80102030));
  const colour = (transformer) => [...cloudArrays(cloud, { ...OPTIONS, transformer }).tints];
  assert.deepEqual(colour("RGB8"), [16, 32, 48, 128]);
  assert.deepEqual(colour("MONO8"), [32, 32, 32, 255]);
});

test("columns are read at any offset, without copies if they are aligned", () => {
  const head = { columns: [["x", 7, 4], ["ring", 2, 1], ["y", 7, 4]] };
  for (const offset of [0, 3]) {
    const bytes = new Uint8Array(offset + 9);
    const view = new DataView(bytes.buffer);
    view.setFloat32(offset, 1.5, true);
    view.setUint8(offset + 4, 7);
    view.setFloat32(offset + 5, -2, true);
    const found = columnsOf(head, bytes.subarray(offset));
    assert.deepEqual([found.get("x")[0], found.get("ring")[0], found.get("y")[0]], [1.5, 7, -2]);
    assert.equal(found.get("x").buffer === bytes.buffer, offset === 0);
  }
});

test("intensities that are not finite have rviz's colours, and leave the others of theirs", () => {
  const rows = [[0, 0, 0, NaN], [0, 0, 0, Infinity], [0, 0, 0, -Infinity], [0, 0, 0, 50]];
  const made = cloudArrays(columns(rows, ["x", "y", "z", "intensity"]), { ...OPTIONS, rainbow: true });
  const found = [0, 1, 2, 3].map((i) => [...made.tints.slice(4 * i, 4 * i + 3)]);
  assert.deepEqual(found, [[0, 0, 255], [255, 0, 255], [255, 0, 0], [0, 255, 128]]);
});
