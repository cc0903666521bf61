// Measuring: two points of the picture, and how far they are apart.

import { BufferAttribute, BufferGeometry, Group, Mesh, MeshBasicMaterial, Raycaster, SphereGeometry, Vector2, Vector3 } from './vendor/three.js';

const mm = (value) => (value * 1000).toFixed(1);

export class Measure {
  /** `tell` gets what is measured, as a text. */
  constructor(stage, tell) {
    this.stage = stage;
    this.tell = tell;
    this.on = false;
    this.points = [];
    this.group = new Group();
    this.material = new MeshBasicMaterial({ color: 0xd55e00, depthTest: false, transparent: true });
    stage.scene.add(this.group);
  }

  toggle() {
    this.on = !this.on;
    this.points = [];
    this.draw();
    this.tell(this.on ? 'Click two points: of the path, the arm or the floor.' : '');
    return this.on;
  }

  /** What is under a place of the canvas (pixels): a planned point first, then a surface. */
  at(x, y) {
    const planned = this.stage.under(x, y);
    if (planned) return new Vector3(...planned.point);
    const { clientWidth: width, clientHeight: height } = this.stage.canvas;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2(x / width * 2 - 1, 1 - y / height * 2), this.stage.camera);
    const solid = ray.intersectObjects([this.stage.robot?.root, this.stage.floor].filter(Boolean), true);
    return solid.find((hit) => hit.object.visible && hit.object.isMesh)?.point ?? null;
  }

  click(x, y) {
    const point = this.at(x, y);
    if (!point) return;
    if (this.points.length > 1) this.points = [];
    this.points.push(point);
    this.draw();
    this.tell(this.words());
  }

  words() {
    const [from, to] = this.points;
    if (!from) return '';
    if (!to) return `from ${from.toArray().map(mm).join(', ')} mm`;
    const away = to.clone().sub(from);
    return `${mm(away.length())} mm  (x ${mm(away.x)}, y ${mm(away.y)}, z ${mm(away.z)})`;
  }

  draw() {
    this.group.clear();
    for (const point of this.points) {
      const dot = new Mesh(new SphereGeometry(0.008, 16, 12), this.material);
      dot.position.copy(point);
      dot.renderOrder = 5;
      this.group.add(dot);
    }
    if (this.points.length === 2) this.group.add(this.line());
    this.stage.dirty = true;
  }

  /** A thin strip between the points: two triangles that are seen from everywhere. */
  line() {
    const [from, to] = this.points;
    const side = to.clone().sub(from).cross(this.stage.camera.position.clone().sub(from)).setLength(0.002);
    const corners = [from.clone().add(side), from.clone().sub(side), to.clone().add(side), to.clone().sub(side)];
    const geometry = new BufferGeometry();
    const order = [0, 1, 2, 2, 1, 3, 2, 1, 0, 3, 1, 2];
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(order.flatMap((k) => corners[k].toArray())), 3));
    const strip = new Mesh(geometry, this.material);
    strip.renderOrder = 5;
    return strip;
  }
}
