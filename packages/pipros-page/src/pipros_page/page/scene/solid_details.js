// The geometries of cubes, spheres and cylinders of size 1, by the size on the screen, because each triangle takes time to draw.

import * as THREE from "three";
import { BOX, CYLINDER, SPHERE } from "./shapes.js";

const FINE = 48; // pixels
const MIDDLE = 14;

function geometry(positions, normals, corners) {
  const made = new THREE.BufferGeometry();
  made.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  made.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
  made.setIndex(corners);
  return made;
}

// A cylinder along z with few sides. The ends have no vertex in their middle.
function smallCylinder(sides) {
  const [positions, normals, corners] = [[], [], []];
  const turns = Array.from({ length: sides }, (_, i) => [Math.cos((2 * Math.PI * i) / sides), Math.sin((2 * Math.PI * i) / sides)]);
  for (const z of [-0.5, 0.5]) for (const [x, y] of turns) {
    positions.push(x / 2, y / 2, z);
    normals.push(x, y, 0);
  }
  for (let i = 0; i < sides; i += 1) {
    const next = (i + 1) % sides;
    corners.push(i, next, sides + next, i, sides + next, sides + i);
  }
  for (const z of [-0.5, 0.5]) {
    const first = positions.length / 3;
    for (const [x, y] of turns) {
      positions.push(x / 2, y / 2, z);
      normals.push(0, 0, 2 * z);
    }
    for (let i = 1; i + 1 < sides; i += 1) corners.push(first, ...(z > 0 ? [first + i, first + i + 1] : [first + i + 1, first + i]));
  }
  return geometry(positions, normals, corners);
}

const cubes = [{ shape: BOX, pixels: MIDDLE }, { shape: "BOX", pixels: 0 }];
const spheres = [{ shape: SPHERE, pixels: FINE }, { shape: new THREE.SphereGeometry(0.5, 12, 8), pixels: MIDDLE },
  { shape: "BALL", pixels: 0 }];
const cylinders = [{ shape: CYLINDER, pixels: FINE }, { shape: smallCylinder(12), pixels: MIDDLE },
  { shape: "TUBE", pixels: 0 }];

// The levels of detail of a BatchOfSolids, by the type of the marker.
export const DETAILS = { 1: cubes, 2: spheres, 3: cylinders };
