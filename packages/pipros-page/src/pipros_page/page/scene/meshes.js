// Meshes and textures of packages, loaded once per URI over the page's connection.

import * as THREE from "three";
import { live } from "../live.js";
import { ColladaLoader } from "three/addons/loaders/ColladaLoader.js";
import { MTLLoader } from "three/addons/loaders/MTLLoader.js";
import { OBJLoader } from "three/addons/loaders/OBJLoader.js";
import { STLLoader } from "three/addons/loaders/STLLoader.js";

const MAX_BYTES = 400e6; // total size of the cached meshes
const MAX_NODES = 100_000; // of a COLLADA file, with those that other nodes repeat
const TEXT = new TextDecoder();

export class Meshes {
  // `fetchBytes(uri)` returns a promise of a Uint8Array.
  constructor(fetchBytes) {
    this.fetchBytes = fetchBytes;
    this.known = new Map(); // URI to a promise of a group
    this.textures = new Map();
    this.missing = new Map(); // URI to why it is not loaded
    this.bytes = 0;
  }

  // Returns a promise of a new object for a mesh. `tint(material)` returns the material to use; the mesh's own materials
  // have `userData.isOwn`.
  async mesh(uri, tint) {
    if (!this.known.has(uri)) {
      const loading = this.load(uri);
      this.known.set(uri, loading);
      this.missing.set(uri, "still loading");
      loading.then(() => this.missing.delete(uri), (error) => {
        this.missing.set(uri, error.message);
        this.known.delete(uri);
      });
    }
    const group = (await this.known.get(uri)).clone();
    group.traverse((each) => {
      if (each.isMesh) each.material = Array.isArray(each.material) ? each.material.map(tint) : tint(each.material);
    });
    return group;
  }

  async load(uri) {
    const bytes = await this.fetchBytes(uri);
    this.bytes += bytes.byteLength;
    if (this.bytes > MAX_BYTES) throw new Error(`the meshes exceed ${MAX_BYTES / 1e6} MB in total`);
    const group = new THREE.Group();
    const extension = uri.split(".").at(-1).toLowerCase();
    if (extension === "stl") group.add(new THREE.Mesh(stlGeometry(bytes), plain()));
    else if (extension === "dae") group.add(await this.collada(uri, TEXT.decode(bytes)));
    else if (extension === "obj") group.add(await this.wavefront(uri, TEXT.decode(bytes)));
    else throw new Error(`${extension} meshes are not supported: use STL, DAE or OBJ`);
    group.traverse(({ geometry }) => {
      if (!geometry) return;
      if (!geometry.getAttribute("position")?.array.every(Number.isFinite))
        throw new Error("it contains invalid floating point values (nans or infs)");
      geometry.userData.isShared = true;
    });
    return group;
  }

  async collada(uri, text) {
    const names = [...text.matchAll(/<init_from>([^<]+)<\/init_from>/g)].map((found) => found[1].trim());
    const blobs = await this.blobs(uri, names.filter((name) => /\.(png|jpe?g|bmp)$/i.test(name)));
    const manager = new THREE.LoadingManager();
    manager.setURLModifier((url) => blobs.get(url.split("/").at(-1)) ?? "data:,");
    if (nodeCount(text) > MAX_NODES) throw new Error(`its nodes repeat others more than ${MAX_NODES} times, or themselves`);
    const parsed = new ColladaLoader(manager).parse(text, "");
    if (!parsed) throw new Error("it is not a COLLADA file");
    const { scene } = parsed;
    scene.rotation.set(0, 0, 0); // rviz ignores up_axis
    const unwanted = [];
    scene.traverse((each) => {
      if (each.isLight || each.isCamera) unwanted.push(each);
      if (each.isMesh) each.material = Array.isArray(each.material) ? each.material.map(lambert) : lambert(each.material);
    });
    for (const each of unwanted) each.removeFromParent();
    return scene;
  }

  async wavefront(uri, text) {
    const loader = new OBJLoader();
    const library = /^mtllib[ \t]+(.+)$/m.exec(text)?.[1].trim();
    if (library) {
      try {
        const materials = TEXT.decode(await this.fetchBytes(beside(uri, library)));
        const names = [...materials.matchAll(/^[ \t]*map_Kd[ \t]+(.+)$/gm)].map((found) => found[1].trim());
        const blobs = await this.blobs(uri, names);
        const manager = new THREE.LoadingManager();
        manager.setURLModifier((url) => blobs.get(url.split("/").at(-1)) ?? "data:,");
        loader.setMaterials(new MTLLoader(manager).parse(materials, ""));
      } catch {
        // if the materials cannot be loaded, the mesh is drawn as if it had none
      }
    }
    const object = loader.parse(text);
    object.traverse((each) => {
      if (!each.isMesh) return;
      if (!each.geometry.getAttribute("normal")) each.geometry.computeVertexNormals();
      each.material = library ? (Array.isArray(each.material) ? each.material.map(lambert) : lambert(each.material)) : plain();
    });
    return object;
  }

  // Returns a promise of addresses of the images of a mesh, by file name.
  async blobs(uri, names) {
    const found = new Map();
    await Promise.all(names.map(async (name) => {
      try {
        const bytes = await this.fetchBytes(name.includes("://") ? name : beside(uri, name));
        found.set(name.split(/[\\/]/).at(-1), URL.createObjectURL(new Blob([bytes])));
      } catch {
        // without the texture, the material keeps its colour
      }
    }));
    return found;
  }

  // Returns a promise of a texture.
  texture(uri) {
    if (!this.textures.has(uri)) {
      const loading = this.loadTexture(uri);
      this.textures.set(uri, loading);
      loading.catch(() => this.textures.delete(uri));
    }
    return this.textures.get(uri);
  }

  async loadTexture(uri) {
    const image = await createImageBitmap(new Blob([await this.fetchBytes(uri)]), { imageOrientation: "flipY" });
    const texture = new THREE.Texture(image);
    texture.flipY = false;
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    texture.needsUpdate = true;
    texture.userData.isShared = true;
    return texture;
  }
}

// Returns a promise of the bytes of a mesh or texture.
export function resourceOf(uri) {
  return new Promise((resolve, reject) => {
    const stop = live.watch("scene_resource", { uri }, (data) => {
      stop();
      resolve(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
    }, (text) => {
      stop();
      reject(new Error(text));
    });
  });
}

// Returns how many nodes the loader makes of a COLLADA file, in which each `instance_node` repeats a whole node.
function nodeCount(text) {
  if (!text.includes("instance_node")) return 0;
  const nodes = [...new DOMParser().parseFromString(text, "application/xml").getElementsByTagName("node")];
  const byId = new Map(nodes.map((node) => [node.id, node]));
  const counts = new Map();
  const count = (node) => {
    if (!counts.has(node)) {
      counts.set(node, Infinity); // if it repeats itself
      const repeated = (each) => (each.localName === "node" ? each : byId.get(each.getAttribute("url")?.slice(1)));
      const inside = [...node.children].filter((each) => ["node", "instance_node"].includes(each.localName)).map(repeated);
      counts.set(node, inside.reduce((sum, each) => sum + (each ? count(each) : 0), 1));
    }
    return counts.get(node);
  };
  return nodes.reduce((sum, node) => sum + count(node), 0);
}

const beside = (uri, name) => `${uri.slice(0, uri.lastIndexOf("/") + 1)}${name.replaceAll("\\", "/").replace(/^\.\//, "")}`;

// The material of meshes without their own.
const plain = () => new THREE.MeshLambertMaterial({ color: 0xffffff });

// Returns a material with the properties that rviz draws: diffuse colour, texture and transparency.
function lambert(from) {
  const { color = 0xffffff, map = null, opacity = 1, side } = from;
  const material = new THREE.MeshLambertMaterial({ color, map, opacity, side });
  if (map) {
    map.colorSpace = THREE.NoColorSpace; // as all colours of the scene: rviz converts none
    map.userData.isShared = true;
  }
  material.userData.isOwn = true;
  return material;
}

// Returns the text of an ASCII STL file without solids and facets that have no end. The loader searches the end of each from
// its begin, for hours if there are a million.
function closedSolids(text) {
  const solids = text.split("endsolid").slice(0, -1).map((each) => each.slice(0, each.lastIndexOf("endfacet") + 8));
  const closed = solids.filter((each) => each.endsWith("endfacet")).map((each) => `${each}\nendsolid\n`);
  if (!closed.length) throw new Error("it is an ASCII STL file without a complete solid");
  return closed.join("").trimStart().padEnd(84);
}

function stlGeometry(bytes) {
  let data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const triangles = data.byteLength < 84 ? 0 : new DataView(data).getUint32(80, true);
  const binaryBytes = 84 + triangles * 50;
  const isText = /^([^]{0,4}|\s*)solid/.test(TEXT.decode(bytes.subarray(0, 64)));
  if (isText && binaryBytes !== data.byteLength) data = closedSolids(TEXT.decode(bytes));
  else if (binaryBytes > data.byteLength)
    throw new Error(`an STL file of ${data.byteLength} bytes cannot have ${triangles} triangles`);
  const geometry = new STLLoader().parse(data);
  geometry.deleteAttribute("color"); // rviz ignores these colours
  const normals = geometry.getAttribute("normal");
  if (!normals || normals.array.every((value) => value === 0)) geometry.computeVertexNormals();
  return geometry;
}
