// Ellipsoids of covariances, as rviz draws them.

import * as THREE from "three";
import { CYLINDER, SPHERE, lit } from "./shapes.js";

const WIDEST = (89 * Math.PI) / 180;

// Returns eigenvalues and eigenvectors (columns) of a symmetric matrix of 3 rows, by Jacobi rotations.
function eigen(rows) {
  const a = rows.map((row) => [...row]);
  const v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  for (let sweep = 0; sweep < 50; sweep += 1) {
    const rest = Math.abs(a[0][1]) + Math.abs(a[0][2]) + Math.abs(a[1][2]);
    if (!(rest > 1e-15)) break;
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      if (a[p][q] === 0) continue;
      const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
      const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
      const c = 1 / Math.sqrt(t * t + 1);
      const s = t * c;
      for (let k = 0; k < 3; k += 1) [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
      for (let k = 0; k < 3; k += 1) [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
      for (let k = 0; k < 3; k += 1) [v[k][p], v[k][q]] = [c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]];
    }
  }
  return { values: [a[0][0], a[1][1], a[2][2]], vectors: v };
}

// Returns the shapes of a covariance of 36 numbers around a pose: {fixed, turning}, where `fixed` keeps the axes of the
// header's frame, and `turning` turns with the pose. `get(...path)` reads the properties below Covariance.
export function covarianceShapes(covariance, get) {
  const fixed = new THREE.Group();
  const turning = new THREE.Group();
  if (![...covariance].every(Number.isFinite)) return { fixed, turning };
  const isFlat = covariance[14] <= 0 && covariance[21] <= 0 && covariance[28] <= 0;
  if (get("Position")) {
    const scale = get("Position", "Scale");
    const mesh = new THREE.Mesh(SPHERE, lit(get("Position", "Color"), get("Position", "Alpha")));
    const cell = (row, column) => (isFlat && (row === 2 || column === 2) ? 0 : covariance[row * 6 + column]);
    const rows = [0, 1, 2].map((row) => [0, 1, 2].map((column) => cell(row, column)));
    const { values, vectors } = eigen(rows);
    const size = values.map((value, axis) => (isFlat && axis === 2 ? 0.001 : 2 * Math.sqrt(Math.max(0, value)) * scale || 0.001));
    const column = (at) => new THREE.Vector3(vectors[0][at], vectors[1][at], vectors[2][at]);
    const basis = new THREE.Matrix4().makeBasis(column(0), column(1), column(2));
    if (basis.determinant() < 0) basis.scale(new THREE.Vector3(1, 1, -1));
    mesh.quaternion.setFromRotationMatrix(basis);
    mesh.scale.set(...size);
    fixed.add(mesh);
  }
  if (!get("Orientation")) return { fixed, turning };
  const holder = get("Orientation", "Frame") === "Fixed" ? fixed : turning;
  if (!isFlat) addDiscs(holder, covariance, get);
  else if (covariance[35] > 0) {
    const offset = get("Orientation", "Offset");
    const half = offset * Math.tan(Math.min(WIDEST, Math.sqrt(covariance[35]) * get("Orientation", "Scale")));
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array([0, 0, 0, offset, -half, 0, offset, half, 0]), 3));
    geometry.computeVertexNormals();
    holder.add(new THREE.Mesh(geometry, lit(get("Orientation", "Color"), get("Orientation", "Alpha"), { side: THREE.DoubleSide })));
  }
  return { fixed, turning };
}

const AXES = [0, 1, 2];
const THIN = 0.001; // metres

// Adds a disc at the tip of each axis, as wide as the other two rotations may move it.
function addDiscs(holder, covariance, get) {
  const read = (name) => get("Orientation", name);
  const offset = read("Offset");
  const wide = (deviation) => 2 * offset * Math.tan(Math.min(WIDEST, deviation * read("Scale"))) || THIN;
  for (const axis of AXES) {
    const [p, q] = AXES.filter((each) => each !== axis);
    const cell = (row, column) => covariance[(row + 3) * 6 + column + 3];
    // A turn about q moves the tip along p, and a turn about p moves it against q. At the z axis, rviz does not exchange them.
    const [one, other, both] = axis === 2 ? [p, q, cell(p, q)] : [q, p, -cell(p, q)];
    const { values, vectors } = eigen([[cell(one, one), both, 0], [both, cell(other, other), 0], [0, 0, 0]]);
    const direction = (at) => new THREE.Vector3().setComponent(p, vectors[0][at]).setComponent(q, vectors[1][at]);
    const basis = new THREE.Matrix4().makeBasis(direction(0), direction(1), direction(0).cross(direction(1)));
    const colour = read("Color Style") === "RGB" ? AXES.map((each) => (each === axis ? 255 : 0)) : read("Color");
    const disc = new THREE.Mesh(CYLINDER, lit(colour, read("Alpha")));
    disc.quaternion.setFromRotationMatrix(basis);
    disc.scale.set(wide(Math.sqrt(Math.max(0, values[0]))), wide(Math.sqrt(Math.max(0, values[1]))), THIN);
    disc.position.setComponent(axis, offset);
    holder.add(disc);
  }
}
