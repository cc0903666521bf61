// An arm from its URDF: shapes, joints, forward kinematics by the scene's own tree.

import { BoxGeometry, CylinderGeometry, Group, Mesh, MeshStandardMaterial, Quaternion, SphereGeometry, Vector3 } from './vendor/three.js';

const numbers = (text, otherwise) => (text ? text.trim().split(/\s+/).map(Number) : otherwise);

/** Places a group as an <origin> says: roll, pitch and yaw about the fixed axes. */
function place(group, element) {
  const origin = element ? [...element.children].find((child) => child.tagName === 'origin') : null;
  const [x, y, z] = numbers(origin && origin.getAttribute('xyz'), [0, 0, 0]);
  const [roll, pitch, yaw] = numbers(origin && origin.getAttribute('rpy'), [0, 0, 0]);
  group.position.set(x, y, z);
  const about = (axis, angle) => new Quaternion().setFromAxisAngle(axis, angle);
  group.quaternion.copy(about(new Vector3(0, 0, 1), yaw))
    .multiply(about(new Vector3(0, 1, 0), pitch))
    .multiply(about(new Vector3(1, 0, 0), roll));
}

/** Sets a group to x, y, z, qw, qx, qy, qz. */
export function setPose(group, [x, y, z, qw, qx, qy, qz]) {
  group.position.set(x, y, z);
  group.quaternion.set(qx, qy, qz, qw);
}

const child = (element, name) => [...element.children].find((found) => found.tagName === name);

/** A primitive shape; nothing for a mesh, which is read from the server. */
function shape(geometry) {
  const box = child(geometry, 'box');
  if (box) return new BoxGeometry(...numbers(box.getAttribute('size')));
  const cylinder = child(geometry, 'cylinder');
  if (cylinder) {
    const radius = Number(cylinder.getAttribute('radius'));
    const made = new CylinderGeometry(radius, radius, Number(cylinder.getAttribute('length')), 40);
    // URDF's cylinders stand along z.
    made.rotateX(Math.PI / 2);
    return made;
  }
  const sphere = child(geometry, 'sphere');
  return sphere ? new SphereGeometry(Number(sphere.getAttribute('radius')), 32, 20) : null;
}

/** The colour that a visual names, or that is given to its name in the whole robot. */
function colourOf(xml, visual) {
  const material = child(visual, 'material');
  if (!material) return null;
  const named = [...xml.children].find((found) => found.tagName === 'material' && found.getAttribute('name') === material.getAttribute('name'));
  const colour = child(material, 'color') || (named && child(named, 'color'));
  return colour ? numbers(colour.getAttribute('rgba')).slice(0, 3) : null;
}

export class Robot {
  /** `about` is the robot as the server tells it; `meshes` gives the shapes of its files, and
   * `ready` is called when they are there. */
  constructor(about, meshes, ready) {
    this.about = about;
    this.meshes = meshes;
    this.ready = ready;
    this.ghost = null;
    /** How many meshes are drawn. */
    this.drawn = 0;
    this.root = new Group();
    this.joints = about.joints.map(() => null);
    this.materials = [];
    const xml = new DOMParser().parseFromString(about.urdf, 'text/xml').documentElement;
    this.links = new Map();
    for (const link of xml.children) if (link.tagName === 'link') this.links.set(link.getAttribute('name'), this.link(link, xml));
    const below = new Set();
    for (const joint of xml.children) if (joint.tagName === 'joint') below.add(this.joint(joint));
    for (const [name, link] of this.links) if (!below.has(name)) this.root.add(link);
    setPose(this.root, about.workstation_from_base);
    this.tip = this.links.get(about.tip_link) || this.root;
    this.tool = new Group();
    if (about.flange_from_tool) {
      setPose(this.tool, about.flange_from_tool);
      this.addTool(about.flange_from_tool);
    }
    this.tip.add(this.tool);
  }

  material(colour) {
    const made = new MeshStandardMaterial({ color: colour, roughness: 0.42, metalness: 0.12 });
    this.materials.push(made);
    return made;
  }

  link(element, xml) {
    const group = new Group();
    const visuals = [...element.children].filter((found) => found.tagName === 'visual');
    for (const [index, visual] of visuals.entries()) {
      const described = child(visual, 'geometry');
      const file = described && child(described, 'mesh');
      if (file) { this.addMesh(group, visual, file, colourOf(xml, visual)); continue; }
      const geometry = described && shape(described);
      if (!geometry) continue;
      // The second shape of a link is its joint: a darker one shows where the arm bends.
      const mesh = new Mesh(geometry, this.material(index === 0 && visuals.length > 1 ? 0xdfe5ec : 0x5b7fa8));
      place(mesh, visual);
      mesh.castShadow = true;
      group.add(mesh);
    }
    return group;
  }

  /** Draws the mesh of a visual as soon as it is there. */
  async addMesh(group, visual, file, colour) {
    const holder = new Group();
    place(holder, visual);
    group.add(holder);
    const shapes = await this.meshes.shapes(file.getAttribute('filename'));
    if (!shapes) return;
    shapes.scale.set(...numbers(file.getAttribute('scale'), [1, 1, 1]));
    shapes.traverse((object) => {
      if (!object.isMesh) return;
      const own = [object.material].flat()[0]?.color;
      const made = this.material(0xb9c3cf);
      if (colour) made.color.setRGB(...colour);
      // The loaders give white where a file has no colour.
      else if (own && own.getHex() !== 0xffffff) made.color.copy(own);
      if (this.ghost !== null) this.fade(made);
      object.material = made;
      object.castShadow = this.ghost === null;
    });
    holder.add(shapes);
    this.drawn += 1;
    this.ready();
  }

  joint(element) {
    const origin = new Group();
    place(origin, element);
    const moving = new Group();
    origin.add(moving);
    const name = element.getAttribute('name');
    const index = this.about.joints.indexOf(name);
    const axis = new Vector3(...numbers(child(element, 'axis')?.getAttribute('xyz'), [1, 0, 0])).normalize();
    const slides = element.getAttribute('type') === 'prismatic';
    if (index >= 0) this.joints[index] = { moving, axis, slides };
    const [parent, kid] = ['parent', 'child'].map((side) => child(element, side).getAttribute('link'));
    this.links.get(parent).add(origin);
    moving.add(this.links.get(kid));
    return kid;
  }

  /** A slim stand-in from the flange to the controlled point. */
  addTool([x, y, z]) {
    const end = new Vector3(x, y, z);
    const length = end.length();
    if (length < 0.005) return;
    const up = new Vector3(0, 0, 1);
    const turn = new Quaternion().setFromUnitVectors(up, end.clone().normalize());
    const add = (from, to, radius) => {
      const geometry = new CylinderGeometry(radius, radius, (to - from) * length, 24);
      geometry.rotateX(Math.PI / 2);
      const mesh = new Mesh(geometry, this.material(0x66717f));
      mesh.position.copy(end).multiplyScalar((from + to) / 2);
      mesh.quaternion.copy(turn);
      mesh.castShadow = true;
      this.tip.add(mesh);
    };
    add(0, 0.55, 0.032);
    add(0.55, 1, 0.012);
  }

  /** Joint positions, rad or m. */
  set(positions) {
    for (const [index, joint] of this.joints.entries()) {
      if (!joint) continue;
      if (joint.slides) joint.moving.position.copy(joint.axis).multiplyScalar(positions[index]);
      else joint.moving.quaternion.setFromAxisAngle(joint.axis, positions[index]);
    }
  }

  /** The controlled point in the workstation. */
  point() {
    this.root.updateWorldMatrix(true, true);
    return this.tool.getWorldPosition(new Vector3());
  }

  /** How the tool is turned in the workstation: w, x, y, z. */
  turn() {
    this.root.updateWorldMatrix(true, true);
    const { w, x, y, z } = this.tool.getWorldQuaternion(new Quaternion());
    return [w, x, y, z];
  }

  /** Makes all shapes transparent, in one colour. */
  makeGhost(colour) {
    this.ghost = colour;
    for (const material of this.materials) this.fade(material);
    this.root.traverse((object) => { object.castShadow = false; });
  }

  fade(material) {
    material.color.set(this.ghost);
    material.transparent = true;
    material.opacity = 0.2;
    material.depthWrite = false;
    // Where both arms are in one place, the real one is seen.
    material.polygonOffset = true;
    material.polygonOffsetFactor = 4;
    material.polygonOffsetUnits = 4;
  }

  dispose() {
    this.root.traverse((object) => { if (object.geometry) object.geometry.dispose(); });
    for (const material of this.materials) material.dispose();
  }
}
