// What stands in the workstation: boxes with names.

import { BoxGeometry, BufferAttribute, BufferGeometry, Group, LineSegments, LineBasicMaterial, Mesh, MeshStandardMaterial, Raycaster, Vector2 } from './vendor/three.js';
import { setPose } from './robot.js';

/** Colours by a word in the class: what is carried stands out from what carries it. */
const COLOURS = [[/Part$|Kit$|Sku/, 0xe69f00], [/Tray|Box|Container/, 0x56b4e9], [/Table|Stand|Station|Changer|Holder/, 0xaab2bd]];

const colourOf = (name) => (COLOURS.find(([word]) => word.test(name)) || [null, 0x9aa7b5])[1];

/** The twelve edges of a box, as pairs of corners. */
function edges([x, y, z]) {
  const corner = (k) => [(k & 1 ? 0.5 : -0.5) * x, (k & 2 ? 0.5 : -0.5) * y, (k & 4 ? 0.5 : -0.5) * z];
  const pairs = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((k) => [1, 2, 4].filter((bit) => !(k & bit)).map((bit) => [k, k | bit]));
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(pairs.flat().flatMap(corner)), 3));
  return geometry;
}

function box({ name, class: kind, pose, size }) {
  const group = new Group();
  setPose(group, pose);
  const colour = colourOf(kind);
  const solid = new Mesh(new BoxGeometry(...size), new MeshStandardMaterial({ color: colour, roughness: 0.7, transparent: true, opacity: 0.75 }));
  solid.castShadow = true;
  solid.receiveShadow = true;
  solid.userData.name = `${name} (${kind})`;
  const lines = new LineSegments(edges(size), new LineBasicMaterial({ color: colour }));
  // The origin of an object is the middle of its bottom.
  for (const part of [solid, lines]) part.position.z = size[2] / 2;
  group.add(solid, lines);
  return group;
}

export class WorldObjects {
  constructor(stage) {
    this.stage = stage;
    this.group = new Group();
    stage.scene.add(this.group);
  }

  set({ objects }) {
    this.group.traverse((object) => { object.geometry?.dispose(); object.material?.dispose(); });
    this.group.clear();
    this.group.add(...objects.map(box));
    this.stage.dirty = true;
  }

  /** The name of what is under a place of the canvas (pixels), if it is nearer than the arm. */
  under(x, y) {
    const { clientWidth: width, clientHeight: height } = this.stage.canvas;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x / width * 2 - 1, 1 - y / height * 2), this.stage.camera);
    const hits = ray.intersectObjects([this.group, this.stage.robot?.root].filter(Boolean), true);
    return hits.find((hit) => hit.object.isMesh)?.object.userData.name ?? null;
  }

  show(shown) { this.group.visible = shown; this.stage.dirty = true; }
}
