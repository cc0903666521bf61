// What the picture shows beside the arm: how far it reaches, and the corridors of smooth moves.

import { BackSide, BufferAttribute, BufferGeometry, CylinderGeometry, DoubleSide, Group, Mesh, MeshBasicMaterial, Vector3 } from './vendor/three.js';

/** The surface of all that the controlled point reaches. */
export function reachSurface({ middle, around, upwards, radii }, colour) {
  const radius = (row, column) => {
    const found = radii[row * around + (column + around) % around];
    if (found > 0) return found;
    const beside = [radii[row * around + (column + 1) % around], radii[row * around + (column + around - 1) % around]];
    return Math.max(...beside, 0.01);
  };
  const positions = [];
  const point = (row, column) => {
    const turn = ((column + 0.5) / around - 0.5) * 2 * Math.PI;
    const rise = ((row + 0.5) / upwards - 0.5) * Math.PI;
    const length = radius(row, column);
    positions.push(middle[0] + length * Math.cos(rise) * Math.cos(turn), middle[1] + length * Math.cos(rise) * Math.sin(turn), middle[2] + length * Math.sin(rise));
  };
  for (let row = 0; row < upwards - 1; row += 1) {
    for (let column = 0; column < around; column += 1) {
      for (const [r, c] of [[0, 0], [0, 1], [1, 1], [0, 0], [1, 1], [1, 0]]) point(row + r, column + c);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  // Its far side only: the near one would lie over the arm.
  const skin = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.1, side: BackSide, depthWrite: false });
  const lines = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.07, wireframe: true, side: DoubleSide, depthWrite: false });
  const group = new Group();
  group.add(new Mesh(geometry, skin), new Mesh(geometry, lines));
  return group;
}

/** The tubes in which smooth moves stay: as wide as the tolerance about each leg. */
export function corridors(plan, colour) {
  const group = new Group();
  const material = new MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.13, depthWrite: false });
  let before = plan.path.points[0];
  for (const command of plan.commands) {
    const { certificate, poses } = command;
    if (!poses || poses.length === 0) continue;
    const width = certificate?.poses?.[0]?.tolerance_m;
    if (width > 1e-4 && certificate.corridor_m !== undefined) {
      const from = [before, ...poses];
      for (let k = 0; k < poses.length; k += 1) addLeg(group, material, from[k], poses[k], width);
    }
    before = poses[poses.length - 1];
  }
  return group;
}

function addLeg(group, material, from, to, width) {
  const [start, end] = [new Vector3(...from), new Vector3(...to)];
  const along = end.clone().sub(start);
  if (along.length() < 1e-4) return;
  const geometry = new CylinderGeometry(width, width, along.length(), 20, 1, true);
  const tube = new Mesh(geometry, material);
  tube.position.copy(start).addScaledVector(along, 0.5);
  tube.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), along.normalize());
  group.add(tube);
}
