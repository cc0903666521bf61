// The picture: arm, goal, paths, tolerances, frames, cameras.

import {
  AxesHelper, Color, DirectionalLight, GridHelper, Group, HemisphereLight, InstancedMesh,
  LineMaterial, LineSegments2, LineSegmentsGeometry, Matrix4, Mesh, MeshBasicMaterial, OrbitControls,
  PCFShadowMap, PerspectiveCamera, PlaneGeometry, Scene, ShadowMaterial, SphereGeometry,
  Vector3, WebGLRenderer,
} from './vendor/three.js';
import { ramp, styled } from './colours.js';
import { corridors, reachSurface } from './layers.js';
import { Robot } from './robot.js';

const TRAIL = 6000;
const AHEAD = new Color(0x0072b2);
const CROSSED = new Color(0xe69f00);
const CAMERAS = { iso: [0.98, -1.16, 0.8], front: [2.1, 0, 0.5], side: [0, -2.1, 0.5], top: [0.001, 0, 2.3] };

/** Line segments that are drawn with a width in pixels and a colour at each end. */
class Segments {
  constructor(scene, most, width, opacity = 1) {
    this.geometry = new LineSegmentsGeometry();
    this.geometry.setPositions(new Float32Array(most * 6));
    this.geometry.setColors(new Float32Array(most * 6));
    this.material = new LineMaterial({ linewidth: width, vertexColors: true, transparent: opacity < 1, opacity });
    this.object = new LineSegments2(this.geometry, this.material);
    // Its bounds are those of the first moment.
    this.object.frustumCulled = false;
    this.most = most;
    this.clear();
    scene.add(this.object);
  }

  clear() { this.count = 0; this.next = 0; this.geometry.instanceCount = 0; this.object.visible = false; }

  /** Adds a segment; the oldest goes where there is no room. */
  add(from, to, colours) {
    const at = this.next * 6;
    const positions = this.geometry.attributes.instanceStart.data;
    const shades = this.geometry.attributes.instanceColorStart.data;
    positions.array.set(from, at);
    positions.array.set(to, at + 3);
    shades.array.set(colours, at);
    this.next = (this.next + 1) % this.most;
    this.count = Math.min(this.count + 1, this.most);
    positions.needsUpdate = true;
    shades.needsUpdate = true;
    this.geometry.instanceCount = this.count;
    this.object.visible = true;
  }
}

export class Stage {
  /** `meshes` gives the shapes that a robot's URDF names. */
  constructor(canvas, meshes) {
    this.canvas = canvas;
    this.meshes = meshes;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(38, 1, 0.02, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => { this.dirty = true; });
    this.layers = { planned: true, travelled: true, balls: true, ghost: true, frames: true, corridor: false, reach: false };
    this.robot = null;
    this.ghost = null;
    this.corridor = null;
    this.surface = null;
    /** Where the ghost stands instead of at the goal, while a taught pose is looked at. */
    this.shownPose = null;
    this.most = 1;
    this.plan = null;
    this.lastPoint = null;
    this.lastTick = 0;
    this.dirty = true;
    this.frames = 0;
    this.light();
    this.trail = new Segments(this.scene, TRAIL, 3.2);
    this.planned = null;
    this.balls = null;
    this.workstation = new AxesHelper(0.18);
    this.scene.add(this.workstation);
    this.look('iso');
    this.theme();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  light() {
    this.sky = new HemisphereLight(0xffffff, 0x8a93a0, 1.7);
    this.sun = new DirectionalLight(0xffffff, 2.1);
    this.sun.position.set(1.4, -1.8, 3);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    Object.assign(this.sun.shadow.camera, { left: -1.8, right: 1.8, top: 1.8, bottom: -1.8, near: 0.5, far: 8 });
    this.scene.add(this.sky, this.sun);
    const floor = new Mesh(new PlaneGeometry(8, 8), new ShadowMaterial({ opacity: 0.22, depthWrite: false }));
    floor.receiveShadow = true;
    floor.position.z = -0.001;
    this.floor = floor;
    this.scene.add(floor);
  }

  theme() {
    this.scene.background = new Color(styled('--field'));
    if (this.grid) { this.scene.remove(this.grid); this.grid.dispose(); }
    // A few hundred cells, as large as what is looked at.
    const size = this.focus ? this.focus.radius * 8 : 4;
    this.grid = new GridHelper(size, 40, new Color(styled('--edge')).lerp(new Color(styled('--dim')), 0.35), new Color(styled('--edge')));
    this.grid.rotation.x = Math.PI / 2;
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.55;
    if (this.focus) this.grid.position.copy(this.focus.middle).setZ(this.focus.low);
    this.scene.add(this.grid);
    this.dirty = true;
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** A camera by its name. */
  look(name) {
    const reach = this.reach || 1;
    const scale = (this.focus ? this.focus.radius * 2.2 : reach) * Math.max(1, 1.25 / Math.max(this.camera.aspect, 0.3));
    const [x, y, z] = CAMERAS[name];
    const middle = this.focus ? this.focus.middle.clone() : new Vector3(0.12, 0, 0.34 * reach);
    if (this.base && !this.focus) middle.add(this.base);
    this.camera.position.set(x, y, z).multiplyScalar(scale).add(middle);
    this.controls.target.copy(middle);
    this.controls.update();
    this.dirty = true;
  }

  /** Turns the picture about its middle (rad): to the side and upwards. */
  turn(aside, upwards) {
    const from = this.camera.position.clone().sub(this.controls.target);
    const length = from.length();
    const around = Math.atan2(from.y, from.x) - aside;
    const rise = Math.min(Math.max(Math.asin(from.z / length) - upwards, -1.5), 1.5);
    from.set(Math.cos(rise) * Math.cos(around), Math.cos(rise) * Math.sin(around), Math.sin(rise)).multiplyScalar(length);
    this.camera.position.copy(this.controls.target).add(from);
    this.controls.update();
    this.dirty = true;
  }

  /** Goes nearer (below 1) or farther. */
  zoom(factor) {
    const from = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(from);
    this.controls.update();
    this.dirty = true;
  }

  /** Cameras look at these points (m) in place of the arm. */
  frameOn(points) {
    const [low, high] = [new Vector3(Infinity, Infinity, Infinity), new Vector3(-Infinity, -Infinity, -Infinity)];
    for (const point of points) {
      low.min(new Vector3(...point));
      high.max(new Vector3(...point));
    }
    this.focus = { middle: low.clone().add(high).multiplyScalar(0.5), radius: Math.max(high.distanceTo(low) / 2, 0.02), low: low.z };
    this.theme();
    this.camera.near = 0.002;
    this.camera.updateProjectionMatrix();
    this.look('iso');
  }

  /** Marks the controlled point (m) where there is no arm. */
  showPoint(point) {
    if (!this.dot) {
      this.dot = new Mesh(new SphereGeometry(1, 24, 16), new MeshBasicMaterial({ color: 0xd55e00 }));
      this.scene.add(this.dot);
    }
    this.dot.scale.setScalar((this.focus?.radius ?? 1) * 0.025);
    this.dot.position.set(...point);
    this.dirty = true;
  }

  setRobot(about) {
    for (const old of [this.robot, this.ghost]) {
      if (old) { this.scene.remove(old.root); old.dispose(); }
    }
    const ready = () => { this.dirty = true; };
    this.robot = new Robot(about, this.meshes, ready);
    this.ghost = new Robot(about, this.meshes, ready);
    this.ghost.makeGhost(0xe69f00);
    this.ghost.root.visible = false;
    this.frame = new AxesHelper(0.11);
    this.robot.tool.add(this.frame);
    this.scene.add(this.robot.root, this.ghost.root);
    this.robot.set(about.home);
    this.most = about.tool.speed;
    // How far the arm is from its base when it is stretched, by the offsets of its joints.
    let length = 0;
    this.robot.root.traverse((object) => { if (object.type === 'Group') length += object.position.length(); });
    this.reach = Math.min(Math.max(length / 1.5, 0.5), 2.6);
    this.base = this.robot.root.position.clone().setZ(0);
    if (this.surface) this.scene.remove(this.surface);
    this.surface = about.reach ? reachSurface(about.reach, 0x0072b2) : null;
    if (this.surface) this.scene.add(this.surface);
    this.clearTrail();
    this.apply();
    this.look('iso');
  }

  setJoints(positions) {
    if (!this.robot || !positions) return;
    this.robot.set(positions);
    this.dirty = true;
  }

  clearTrail() { this.trail.clear(); this.lastPoint = null; this.dirty = true; }

  /** The controlled point was at `point` (m) at `tick`. */
  travel(point, tick, period) {
    if (this.lastPoint) {
      const length = Math.hypot(...point.map((value, axis) => value - this.lastPoint[axis]));
      // A rest adds nothing, however long it lasts.
      if (length < 0.0005) return;
      const speed = length / (Math.max(tick - this.lastTick, 1) * period);
      const shade = [0, 0, 0, 0, 0, 0];
      ramp(speed / this.most, shade, 0);
      ramp(speed / this.most, shade, 3);
      if (length < 0.2) this.trail.add(this.lastPoint, point, shade);
    }
    this.lastPoint = point;
    this.lastTick = tick;
    this.dirty = true;
  }

  /** Draws a plan: path, tolerances, the goal; nothing for none. */
  setPlan(plan) {
    if (this.planned) { this.scene.remove(this.planned.object); this.planned = null; }
    if (this.balls) { this.scene.remove(this.balls); this.balls = null; }
    if (this.corridor) { this.scene.remove(this.corridor); this.corridor = null; }
    this.hasGoal = false;
    this.plan = plan;
    this.dirty = true;
    if (this.ghost) this.ghost.root.visible = false;
    if (!plan || !plan.path || plan.path.points.length < 2) return;
    const { points, step_s: step, joints } = plan.path;
    this.planned = new Segments(this.scene, points.length, 2.2, 0.75);
    const shade = [0, 0, 0, 0, 0, 0];
    for (let k = 1; k < points.length; k += 1) {
      const speed = Math.hypot(...points[k].map((value, axis) => value - points[k - 1][axis])) / step;
      if (speed < 1e-4) continue;
      ramp(speed / this.most, shade, 0);
      ramp(speed / this.most, shade, 3);
      this.planned.add(points[k - 1], points[k], shade);
    }
    this.setBalls(plan);
    this.corridor = corridors(plan, 0x009e73);
    this.scene.add(this.corridor);
    if (this.ghost && joints.length > 0) {
      this.goal = joints[joints.length - 1];
      this.hasGoal = true;
    }
    this.apply();
  }

  /** Shows the ghost arm at these joints, or at the goal again with null. */
  showPose(joints) { this.shownPose = joints; this.apply(); }

  setBalls(plan) {
    const found = [];
    for (const command of plan.commands) {
      for (const pass of (command.certificate && command.certificate.poses) || []) {
        const pose = command.poses[pass.index - 1];
        if (pose) found.push({ pose, radius: Math.max(pass.tolerance_m, 0.002), command: command.index, time: pass.time_s });
      }
    }
    if (found.length === 0) return;
    this.crossings = found;
    const material = new MeshBasicMaterial({ transparent: true, opacity: 0.28, depthWrite: false });
    this.balls = new InstancedMesh(new SphereGeometry(1, 20, 14), material, found.length);
    for (const [index, { pose, radius }] of found.entries()) {
      this.balls.setMatrixAt(index, new Matrix4().makeScale(radius, radius, radius).setPosition(...pose));
      this.balls.setColorAt(index, AHEAD);
    }
    this.passed = 0;
    this.balls.frustumCulled = false;
    this.scene.add(this.balls);
  }

  /** Marks the via points that were crossed: those up to `time` s of command number `command`. */
  cross(command, time) {
    if (!this.balls) return;
    const done = (via) => via.command < command || (via.command === command && via.time <= time);
    const passed = this.crossings.filter(done).length;
    if (passed === this.passed) return;
    this.passed = passed;
    for (const [index, via] of this.crossings.entries()) this.balls.setColorAt(index, done(via) ? CROSSED : AHEAD);
    this.balls.instanceColor.needsUpdate = true;
    this.dirty = true;
  }

  show(layer, shown) { this.layers[layer] = shown; this.apply(); }

  apply() {
    const { layers } = this;
    if (this.planned) this.planned.object.visible = layers.planned && this.planned.count > 0;
    this.trail.object.visible = layers.travelled && this.trail.count > 0;
    if (this.balls) this.balls.visible = layers.balls;
    const ghostAt = this.shownPose || (layers.ghost && this.plan !== null && this.hasGoal ? this.goal : null);
    if (this.ghost) this.ghost.root.visible = ghostAt !== null;
    if (this.ghost && ghostAt) this.ghost.set(ghostAt);
    if (this.corridor) this.corridor.visible = layers.corridor;
    if (this.surface) this.surface.visible = layers.reach;
    this.workstation.visible = layers.frames;
    if (this.frame) this.frame.visible = layers.frames;
    this.dirty = true;
  }

  /** What of the plan is under a place of the canvas (pixels): time, command, speed. */
  under(x, y) {
    if (!this.plan || !this.plan.path || !this.layers.planned) return null;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { points, joints, step_s: step, commands } = this.plan.path;
    const seen = new Vector3();
    let best = null;
    for (let k = 0; k < points.length; k += 1) {
      seen.set(...points[k]).project(this.camera);
      const away = Math.hypot((seen.x + 1) / 2 * width - x, (1 - seen.y) / 2 * height - y);
      if (away < 9 && (!best || away < best.away)) best = { away, k };
    }
    if (!best) return null;
    const point = points[best.k];
    const before = points[Math.max(best.k - 1, 0)];
    return {
      time: best.k * step,
      command: commands[best.k],
      point,
      joints: joints[best.k],
      speed: Math.hypot(...point.map((value, axis) => value - before[axis])) / step,
    };
  }

  /** Draws if something is new. */
  draw() {
    if (!this.dirty) return;
    this.dirty = false;
    this.frames += 1;
    if (!this.layers.travelled) this.trail.object.visible = false;
    this.renderer.render(this.scene, this.camera);
  }
}
