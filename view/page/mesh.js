// The meshes that a URDF names: read from the server, drawn as the arm's own shapes.

import { ColladaLoader, Group, LoadingManager, Mesh, OBJLoader, STLLoader } from './vendor/three.js';

// A picture of a Collada file is not asked for: the server has meshes only.
const manager = new LoadingManager();
manager.setURLModifier(() => 'data:image/gif;base64,R0lGODlhAQABAAAAACw=');

const text = (buffer) => new TextDecoder().decode(buffer);

/** The shapes of a file by the end of its name. */
function parse(name, buffer) {
  switch (name.split('.').pop().toLowerCase()) {
    case 'stl': return new Mesh(new STLLoader().parse(buffer));
    case 'obj': return new OBJLoader(manager).parse(text(buffer));
    default: {
      // Which axis is up was for other programs: in a URDF the axes of the file are those of the link.
      const plain = text(buffer).replace(/<up_axis>[^<]*<\/up_axis>/, '');
      return new ColladaLoader(manager).parse(plain, '').scene;
    }
  }
}

export class Meshes {
  /** `token` opens the server's files; `onmissing` gets the names that cannot be drawn. */
  constructor(token, onmissing) {
    this.token = token;
    this.onmissing = onmissing;
    this.files = new Map();
  }

  /** The shapes of a mesh, for every caller their own; null where it cannot be read. */
  async shapes(name) {
    if (!this.files.has(name)) this.files.set(name, this.read(name));
    const found = await this.files.get(name);
    return found && found.clone();
  }

  async read(name) {
    try {
      const answer = await fetch(`/mesh/${encodeURIComponent(name)}`, { headers: { Authorization: `Bearer ${this.token}` } });
      if (!answer.ok) throw new Error(await answer.text());
      const group = new Group();
      group.add(parse(name, await answer.arrayBuffer()));
      const others = [];
      group.traverse((object) => {
        if (object.isLight || object.isCamera) others.push(object);
        if (object.isMesh && !object.geometry.attributes.normal) object.geometry.computeVertexNormals();
      });
      for (const object of others) object.removeFromParent();
      return group;
    } catch {
      this.onmissing(name);
      return null;
    }
  }
}
